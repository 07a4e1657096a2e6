//! Checks the bytes of messages against expected CDR written by hand, and the type hashes against
//! those of rosidl. (CDR: OMG CORBA 3.4, 9.3: natural alignment from the start of the body,
//! strings with their length and a zero.)

use byteorder::LittleEndian;
use cdr_encoding::{from_bytes, to_vec};
use metaplan_ros::interfaces::*;

use builtin_interfaces::msg::Time;

fn check<T: Structure + PartialEq + std::fmt::Debug>(value: &T, pieces: &[&[u8]]) {
    let expected = pieces.concat();
    assert_eq!(to_vec::<T, LittleEndian>(value).expect("bytes"), expected, "{}", T::TYPE);
    let (read, length) = from_bytes::<T, LittleEndian>(&expected).expect("a value");
    assert_eq!((&read, length), (value, expected.len()), "{}", T::TYPE);
}

#[test]
fn a_diagnostic_array() {
    use diagnostic_msgs::msg::{DiagnosticArray, DiagnosticStatus, KeyValue};

    let values = vec![KeyValue { key: "c_thruster_1".into(), value: "FALSE".into() }];
    let status = DiagnosticStatus {
        level: DiagnosticStatus::ERROR,
        name: "monitor".into(),
        message: "Component status".into(),
        hardware_id: String::new(),
        values,
    };
    let header = std_msgs::msg::Header { stamp: Time { sec: -1, nanosec: 2 }, frame_id: "m".into() };
    check(
        &DiagnosticArray { header, status: vec![status] },
        &[
            &[255, 255, 255, 255, 2, 0, 0, 0],
            &[2, 0, 0, 0, b'm', 0, 0, 0],
            &[1, 0, 0, 0],
            &[2, 0, 0, 0],
            &[8, 0, 0, 0],
            b"monitor\0",
            &[17, 0, 0, 0],
            b"Component status\0\0\0\0",
            &[1, 0, 0, 0, 0, 0, 0, 0],
            &[1, 0, 0, 0],
            &[13, 0, 0, 0],
            b"c_thruster_1\0\0\0\0",
            &[6, 0, 0, 0],
            b"FALSE\0",
        ],
    );
}

/// Doubles are aligned to eight bytes. An empty sequence consists only of its length, even if its
/// elements are doubles.
#[test]
fn a_parameter_value() {
    use rcl_interfaces::msg::{ParameterType, ParameterValue};

    let value = ParameterValue {
        r#type: ParameterType::PARAMETER_DOUBLE,
        double_value: 1.0,
        integer_array_value: vec![7],
        string_array_value: vec!["x".into()],
        ..ParameterValue::default()
    };
    check(
        &value,
        &[
            &[3, 0, 0, 0, 0, 0, 0, 0],
            &[0; 8],
            &[0, 0, 0, 0, 0, 0, 0xf0, 0x3f],
            // An empty string, no bytes, no Booleans.
            &[1, 0, 0, 0, 0, 0, 0, 0],
            &[0; 8],
            &[1, 0, 0, 0, 0, 0, 0, 0],
            &[7, 0, 0, 0, 0, 0, 0, 0],
            &[0; 4],
            &[1, 0, 0, 0, 2, 0, 0, 0, b'x', 0],
        ],
    );
}

#[test]
fn a_plan_and_the_answer_that_carries_it() {
    use plansys2_msgs::msg::{Plan, PlanItem};
    use plansys2_msgs::srv::GetPlanResponse;

    let items = vec![PlanItem { time: 0.5, action: "(a)".into(), duration: 2.0 }];
    let value = GetPlanResponse { success: true, plan: Plan { items }, error_info: "no".into() };
    check(
        &value,
        &[
            &[1, 0, 0, 0],
            &[1, 0, 0, 0],
            &[0, 0, 0, 0x3f],
            &[4, 0, 0, 0],
            b"(a)\0",
            &[0, 0, 0, 0x40],
            &[3, 0, 0, 0],
            b"no\0",
        ],
    );
}

#[test]
fn arrays_have_no_length_and_empty_structures_have_a_byte() {
    use action_msgs::msg::GoalInfo;

    let goal_id = unique_identifier_msgs::msg::UUID { uuid: *b"0123456789abcdef" };
    let stamp = Time { sec: 1, nanosec: 0 };
    check(&GoalInfo { goal_id, stamp }, &[b"0123456789abcdef", &[1, 0, 0, 0, 0, 0, 0, 0]]);
    check(&std_msgs::msg::Empty::default(), &[&[0]]);
    check(&lifecycle_msgs::srv::GetStateRequest::default(), &[&[0]]);
    check(&mros2_msgs::action::ControlQosResult::default(), &[&[0]]);
    check(&suave_msgs::action::SpiralSearchGoal::default(), &[&[0]]);
}

/// Checks the alignment of `i16` and `i8` before strings, of a sequence of strings, and of an `f32`
/// after a Boolean.
#[test]
fn an_action_execution() {
    use plansys2_msgs::msg::ActionExecution;

    let value = ActionExecution {
        r#type: ActionExecution::CANCEL,
        node_id: "n".into(),
        action: "go".into(),
        arguments: vec!["a".into(), "bcd".into()],
        success: true,
        completion: 1.0,
        status: String::new(),
    };
    check(
        &value,
        &[
            &[7, 0, 0, 0],
            &[2, 0, 0, 0, b'n', 0, 0, 0],
            &[3, 0, 0, 0, b'g', b'o', 0, 0],
            &[2, 0, 0, 0],
            &[2, 0, 0, 0, b'a', 0, 0, 0],
            &[4, 0, 0, 0, b'b', b'c', b'd', 0],
            &[1, 0, 0, 0],
            &[0, 0, 0x80, 0x3f],
            &[1, 0, 0, 0, 0],
        ],
    );
}

#[test]
fn a_variant_has_its_own_fields() {
    let common = lifecycle_msgs::msg::TransitionEvent { timestamp: 1, ..Default::default() };
    let stamp = Time { sec: 0, nanosec: 1 };
    let lyrical = lyrical::lifecycle_msgs::msg::TransitionEvent { stamp, ..Default::default() };
    // Bytes have no alignment, the length of a string is aligned to four bytes.
    let states = [0, 0, 0, 0, 1, 0, 0, 0, 0, 0, 0, 0, 1, 0, 0, 0, 0, 0, 0, 0, 1, 0, 0, 0, 0];
    check(&common, &[&[1, 0, 0, 0, 0, 0, 0, 0], &states]);
    check(&lyrical, &[&[0, 0, 0, 0, 1, 0, 0, 0], &states]);
}

/// Expected values: `rosidl_generator_type_description` 4.9.5 (from `PyPI`:
/// `ros-rosidl-generator-type-description`), applied to the definitions below `interfaces/`.
#[test]
fn hashes_of_messages_are_those_of_rosidl() {
    let cases = [
        (
            diagnostic_msgs::msg::DiagnosticArray::RIHS01,
            "5a8a36efb05fb25070fa0fb3810290c0e6cd4862b54a8fb975a1ee8dc55a333e",
        ),
        (
            lifecycle_msgs::msg::TransitionEvent::RIHS01,
            "d5f8873a2f0146498f812d7885c7327ce27e463d36811d8792f35ee38c0d6c38",
        ),
        (
            rcl_interfaces::msg::ParameterEvent::RIHS01,
            "043e627780fcad87a22d225bc2a037361dba713fca6a6b9f4b869a5aa0393204",
        ),
        (
            unique_identifier_msgs::msg::UUID::RIHS01,
            "1b8e8aca958cbea28fe6ef60bf6c19b683c97a9ef60bb34752067d0f2f7ab437",
        ),
        (
            lyrical::lifecycle_msgs::msg::TransitionEvent::RIHS01,
            "78b19e2be41a797fc009c96bda68944182edabec7852cccd928a40bc06f6f9d7",
        ),
        (
            mros2_msgs::action::ControlQos::FEEDBACK_RIHS01,
            "509605b09dd6de7514326e102088aa11d10a16f133ae7ceb76c81b021e0b776e",
        ),
        (
            sensor_msgs::msg::BatteryState::RIHS01,
            "4bee5dfce981c98faa6828b868307a0a73f992ed0789f374ee96c8f840e69741",
        ),
        (
            sensor_msgs::msg::LaserScan::RIHS01,
            "64c191398013af96509d518dac71d5164f9382553fce5c1f8cca5be7924bd828",
        ),
        (
            sensor_msgs::msg::NavSatFix::RIHS01,
            "62223ab3fe210a15976021da7afddc9e200dc9ec75231c1b6a557fc598a65404",
        ),
        (sensor_msgs::msg::Range::RIHS01, "b42b62562e93cbfe9d42b82fe5994dfa3d63d7d5c90a317981703f7388adff3a"),
        (
            sensor_msgs::msg::Temperature::RIHS01,
            "72514a14126ab9f8a9abec974c78e5610a367b59db5da355ff1fb982d5bad4b8",
        ),
        (
            sensor_msgs::msg::Illuminance::RIHS01,
            "b954b25f452fcf81a91c9c2a7e3b3fd85c4c873d452aecb3cfd8fd1da732a22d",
        ),
        (std_msgs::msg::Float64::RIHS01, "705ba9c3d1a09df43737eb67095534de36fd426c0587779bda2bc51fe790182a"),
        (
            rosgraph_msgs::msg::Clock::RIHS01,
            "692f7a66e93a3c83e71765d033b60349ba68023a8c689a79e48078bcb5c58564",
        ),
        (
            std_srvs::srv::SetBoolRequest::RIHS01,
            "c62fbb99d94e1b25e8ef9e109f9581956bb1b3361a45a4e5810c36a90d29932e",
        ),
    ];
    for (hash, expected) in cases {
        assert_eq!(hash, format!("RIHS01_{expected}"));
    }
}

/// ROS 2 announces the hashes of request and response on the topics of a service, not the hash of
/// the service. Expected values: as in [`hashes_of_messages_are_those_of_rosidl`].
#[test]
fn topics_of_services_have_the_hashes_of_their_messages() {
    use mros2_msgs::action::ControlQos;
    use nav2_msgs::action::NavigateToPose;

    let cases = [
        (
            ServiceHashes::of::<lifecycle_msgs::srv::ChangeState>(),
            "d74c6f524e14cade7b67e7297190360ed749264af300524fc1456f27cc2a553a",
            "e1ddfed0271fefe63767aa71561926e4d9eac0f1ddf9e71a8873eb46b36deac2",
        ),
        (
            ServiceHashes::of::<rcl_interfaces::srv::DescribeParameters>(),
            "05dd1c2bc87dec2627105c8070d6f9725c781a4f2ab852975bf105462b82b644",
            "ad6747319613c6131589e062e095b469a46cc764f7d0f12a001a49e6cd893995",
        ),
        (
            ServiceHashes::of::<std_srvs::srv::Empty>(),
            "458eaf200a3f63d9cc53d19436edebc0c140ef4c93ca75d5bd4ce19fd7759e35",
            "0a2858b3f60df644a61d0fa44cfc923a3d3628e0ad9c8ad8534b1a2c92a413dc",
        ),
        (
            ServiceHashes::of::<action_msgs::srv::CancelGoal>(),
            "3d3c84653c1f96918086887e1dcb236faec88b81a5b14fd4cf4840065bcdf8af",
            "35e682cf3f510e83c70a82a4aac888496dedee56773bf9d8e5e0aa81f9e1c960",
        ),
        (
            ServiceHashes::of::<system_modes_msgs::srv::ChangeMode>(),
            "9153cd92dab8169339460ceada3113eacd2a96d31d62cb31305a2c09a3d01fdc",
            "4771543cc0c34b4b4f7de2d92e443e2ed6e5c24b66f34dc2c923db932d324648",
        ),
        (
            ServiceHashes::of::<plansys2_msgs::srv::GetPlan>(),
            "9d43913e276abda229462b578ea0927ac98bd5b5b7c21fd169e6b4a64ee0923a",
            "29edb38da18ac576d3f14b7d2b7a030b9d155b8566b5cc00f7ad0056435088bb",
        ),
        (
            ServiceHashes::of::<suave_msgs::srv::Task>(),
            "0da395687b2bed9f16a862e0bd2b4edd4f416f4285fd89f5cbd344b80c68fbc3",
            "d4d4e91304ec2d4b1c7013c36f294084586f02e86ac12684ca4db06d19af4488",
        ),
        (
            ControlQos::SEND_GOAL_RIHS01,
            "9a2c73d5b6d4b6aa6f6c4a983121059a95f68f2ae027358f70038067f9080658",
            "b78348af0c53a3e302ac320c27508e01bec9a7eee10c56344c59a13e5ad405b5",
        ),
        (
            ControlQos::GET_RESULT_RIHS01,
            "0e3a7e2b9902d0edb8c9e2dc1b288a64565b435ca18bca5d316bbbf9ef6b3d54",
            "4765f95318126115e3bfed38f4c235794705c9f729f53ff4aeb705012d61583c",
        ),
        (
            NavigateToPose::SEND_GOAL_RIHS01,
            "e9381f2acfe9fa8c4838a277d0cde28a93c483564827b9f13496b9c2092e4f09",
            "99f97fcbb07daf024df4b8c3f02f19ce7fa3183fcedfb76b8772a61a371a55fa",
        ),
        (
            NavigateToPose::GET_RESULT_RIHS01,
            "106d3457cf0db4c4a8d3373bab3ff6aa8ba8ad99ae6392ce9784830a7d04ac93",
            "c59f178c377de5318919c00bdbf7884cb3b185acfdffceba6c9f161e0aa3cc81",
        ),
    ];
    for (hashes, request, response) in cases {
        assert_eq!(hashes.request, format!("RIHS01_{request}"));
        assert_eq!(hashes.response, format!("RIHS01_{response}"));
    }
}

#[test]
fn names_are_those_of_the_definitions() {
    use plansys2_msgs::srv::GetPlan;

    assert_eq!((GetPlan::PACKAGE, GetPlan::NAME), ("plansys2_msgs", "GetPlan"));
    assert_eq!(<GetPlan as Service>::Response::TYPE, "plansys2_msgs/srv/GetPlan_Response");
    assert_eq!(std_msgs::msg::String::NAME, "String");
    assert_eq!(<mros2_msgs::action::ControlQos as Action>::Goal::TYPE, "mros2_msgs/action/ControlQos_Goal");
}
