//! Catalogue of the message codes of `metaplan-ros`.

/// Codes in order, each with meaning, cause and remedy.
pub const CODES: &[[&str; 4]] = &[
    [
        "N100",
        "`metaplan-ros` cannot begin.",
        "Signals cannot be listened to, `--mission` is missing, or `--journal` is given to a role that remembers nothing.",
        "Give `--mission FILE`; `--journal` is for the manager and the reasoner.",
    ],
    [
        "N101",
        "An argument after `--ros-args` is wrong.",
        "A word, a rule of remapping, a parameter or a level of the log is malformed.",
        "Rules are `from:=to`, parameters `name:=value`.",
    ],
    [
        "N102",
        "A file of parameters cannot be used.",
        "It cannot be read, is not YAML, or does not have the form of parameter files.",
        "Write `node: {ros__parameters: {name: value}}`.",
    ],
    [
        "N103",
        "A parameter is wrong.",
        "Its value has another type (an error), or the node has no such parameter (a warning).",
        "Take the name that the message proposes.",
    ],
    [
        "N110",
        "A variable of the environment is wrong.",
        "`ROS_DOMAIN_ID` or the range of discovery has a value that does not exist.",
        "Correct it, or unset it.",
    ],
    [
        "N111",
        "A variable of the environment is not supported.",
        "`ROS_STATIC_PEERS` and the range `OFF` are not.",
        "Nothing, if discovery by multicast suffices.",
    ],
    [
        "N120",
        "There is no participant.",
        "There is no network, or no free port in the domain.",
        "Check the network and `ROS_DOMAIN_ID`.",
    ],
    [
        "N121",
        "A name is not a name of ROS 2.",
        "A node, topic or service has characters that ROS 2 does not admit.",
        "Use letters, digits, `_` and `/`.",
    ],
    [
        "N122",
        "A topic, service or action cannot be made.",
        "The message gives the reason.",
        "Check its name and the network.",
    ],
    [
        "N130",
        "The settings cannot be used.",
        "`ros.toml` cannot be read, or something in it is wrong.",
        "Correct what the message names.",
    ],
    [
        "N132",
        "Designs are not modes of the robot.",
        "The node of a function does not have a mode of that name.",
        "Name the modes under `[functions.F.modes]` of the settings.",
    ],
    [
        "N140",
        "There is nothing to choose from.",
        "The mission of a reasoner has no knowledge base.",
        "Give a mission with `[knowledge]`.",
    ],
    [
        "N141",
        "What the reasoner remembers cannot be used.",
        "Its file in the journal's directory is damaged, or cannot be written.",
        "Mend or remove the file.",
    ],
    [
        "N150",
        "The controller gives up.",
        "Five plans one after another have failed.",
        "Read why in the log; mend the cause, and start it again.",
    ],
];
