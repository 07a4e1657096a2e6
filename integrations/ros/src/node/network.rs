//! ROS domain and network interface of a node, from the environment variables of ROS 2.

use std::net::Ipv4Addr;

use metaplan::message::Message;
use ros2_client::dds::rustdds::DomainParticipantBuilder;

/// Greatest domain id with valid ports (RTPS 2.5, section 9.6.1.1).
const GREATEST_DOMAIN: u16 = 232;

/// ROS domain and discovery range of a node.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Network {
    /// ROS domain id: `ROS_DOMAIN_ID`, by default 0.
    pub domain: u16,
    /// `true` to restrict discovery to this machine: `ROS_AUTOMATIC_DISCOVERY_RANGE` is `LOCALHOST` (or
    /// `OFF`, which is not supported), or `ROS_LOCALHOST_ONLY=1` of older distributions.
    pub loopback: bool,
}

impl Network {
    /// Reads the environment variables, which `variable` returns by name. Also returns warnings
    /// about unsupported values.
    ///
    /// # Errors
    /// Fails if a variable has an invalid value.
    pub fn from_environment(
        variable: impl Fn(&str) -> Option<String>,
    ) -> Result<(Self, Vec<Message>), Message> {
        let value = |name: &str| variable(name).filter(|value| !value.trim().is_empty());
        let mut warnings = Vec::new();
        let domain = match value("ROS_DOMAIN_ID") {
            None => 0,
            Some(text) => {
                text.trim().parse().ok().filter(|domain| *domain <= GREATEST_DOMAIN).ok_or_else(|| {
                    network_error(format!(
                        "ROS_DOMAIN_ID is `{text}`, but should be a number from 0 to {GREATEST_DOMAIN}"
                    ))
                })?
            }
        };
        let only = value("ROS_LOCALHOST_ONLY").is_some_and(|value| value.trim() == "1");
        let loopback = match value("ROS_AUTOMATIC_DISCOVERY_RANGE")
            .map(|range| range.to_uppercase())
            .as_deref()
        {
            // `ROS_LOCALHOST_ONLY=1` takes precedence over these values (release notes of Jazzy).
            None | Some("SYSTEM_DEFAULT" | "SUBNET") => only,
            Some("LOCALHOST") => true,
            Some("OFF") => {
                warnings.push(Message::warning(
                    "N111",
                    "ROS_AUTOMATIC_DISCOVERY_RANGE=OFF is not supported: participants on this machine are found",
                ));
                true
            }
            Some(other) => {
                return Err(network_error(format!(
                    "ROS_AUTOMATIC_DISCOVERY_RANGE is `{other}`, but should be SUBNET, LOCALHOST, OFF or SYSTEM_DEFAULT"
                )));
            }
        };
        if let Some(peers) = value("ROS_STATIC_PEERS") {
            let text = format!(
                "ROS_STATIC_PEERS ({peers}) is not supported: participants are discovered by multicast only"
            );
            warnings.push(Message::warning("N111", text));
        }
        Ok((Self { domain, loopback }, warnings))
    }

    pub(crate) fn participant(self) -> DomainParticipantBuilder {
        let builder = DomainParticipantBuilder::new(self.domain);
        if self.loopback { builder.with_only_networks([Ipv4Addr::LOCALHOST]) } else { builder }
    }
}

fn network_error(text: String) -> Message {
    Message::error("N110", text)
}

#[cfg(test)]
mod tests {
    use super::Network;

    fn check(variables: &[(&str, &str)], expected: Option<(u16, bool, usize)>) {
        let value = |name: &str| {
            variables.iter().find(|(known, _)| *known == name).map(|(_, value)| (*value).to_owned())
        };
        let summary = Network::from_environment(value).ok();
        let summary = summary.map(|(network, warnings)| (network.domain, network.loopback, warnings.len()));
        assert_eq!(summary, expected, "{variables:?}");
    }

    #[test]
    fn variables_of_all_distributions_are_read() {
        check(&[], Some((0, false, 0)));
        check(&[("ROS_DOMAIN_ID", "42"), ("ROS_LOCALHOST_ONLY", "0")], Some((42, false, 0)));
        check(&[("ROS_LOCALHOST_ONLY", "1")], Some((0, true, 0)));
        check(&[("ROS_AUTOMATIC_DISCOVERY_RANGE", "localhost")], Some((0, true, 0)));
        check(
            &[("ROS_AUTOMATIC_DISCOVERY_RANGE", "SUBNET"), ("ROS_LOCALHOST_ONLY", "1")],
            Some((0, true, 0)),
        );
        check(&[("ROS_AUTOMATIC_DISCOVERY_RANGE", "OFF"), ("ROS_STATIC_PEERS", "a;b")], Some((0, true, 2)));
        check(&[("ROS_AUTOMATIC_DISCOVERY_RANGE", "MOON")], None);
        check(&[("ROS_DOMAIN_ID", "233")], None);
        check(&[("ROS_DOMAIN_ID", "robot")], None);
    }
}
