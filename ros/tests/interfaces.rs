//! The bytes of messages against CDR (OMG CORBA 3.4, 9.3: natural alignment from the start of the body, strings with their length and a
//! zero), written by hand, and the type hashes against those of other implementations.

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

/// Doubles begin at multiples of eight; an empty sequence has its length and nothing else, also before doubles.
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

/// `i16` and `i8` before strings, a sequence of strings, a `f32` behind a Boolean.
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
    // A byte stands anywhere, the length of a string at multiples of four.
    let states = [0, 0, 0, 0, 1, 0, 0, 0, 0, 0, 0, 0, 1, 0, 0, 0, 0, 0, 0, 0, 1, 0, 0, 0, 0];
    check(&common, &[&[1, 0, 0, 0, 0, 0, 0, 0], &states]);
    check(&lyrical, &[&[0, 0, 0, 0, 1, 0, 0, 0], &states]);
}

/// As `ros2_pyterfaces` 0.3.0 (from `PyPI`) computes them for Jazzy, `hash_rihs01` of its `core` types.
#[test]
fn hashes_are_those_of_the_distribution() {
    let cases = [
        (
            diagnostic_msgs::msg::DiagnosticArray::RIHS01,
            "5a8a36efb05fb25070fa0fb3810290c0e6cd4862b54a8fb975a1ee8dc55a333e",
        ),
        (
            lifecycle_msgs::srv::ChangeState::RIHS01,
            "356fe34f0475a43acf54542013af4167b0e729f77ea22ffb045c6ad8e20668e5",
        ),
        (
            lifecycle_msgs::srv::GetState::RIHS01,
            "800a0a5aae599782b02932de0caf563f6dc4e7e94b794eadde075ba2cbef9795",
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
            rcl_interfaces::srv::DescribeParameters::RIHS01,
            "845b484d71eb0673dae682f2e3ba3c4851a65a3dcfb97bddd82c5b57e91e4cff",
        ),
        (std_srvs::srv::Empty::RIHS01, "5888399dedec5ccc85ea6451949fd2c9f97bfdf963f9a588821639fcd31b5d19"),
        (
            unique_identifier_msgs::msg::UUID::RIHS01,
            "1b8e8aca958cbea28fe6ef60bf6c19b683c97a9ef60bb34752067d0f2f7ab437",
        ),
    ];
    for (own, expected) in cases {
        assert_eq!(own, format!("RIHS01_{expected}"));
    }
}

/// As `rosbags` 0.11.9 (from `PyPI`) computes them: `hash_rihs01` of definitions written from REP-2011 (a service is its request, response and
/// event, an action its two services and its feedback message). `ServiceEventInfo` had to be given as it is in ROS, with `uint8[16]`.
#[test]
fn hashes_of_services_and_actions_are_those_of_rosbags() {
    use mros2_msgs::action::ControlQos;

    let cases = [
        (
            system_modes_msgs::srv::ChangeMode::RIHS01,
            "33eb3d2cdf66fa000d2b1b07e27c2abbabeefb4acd8d13a3a1c3f2c397f9094f",
        ),
        (
            action_msgs::srv::CancelGoal::RIHS01,
            "573d8b0a534451d7bc2ac8c5ffde8ac14b8593b7001175d0cd6516dcbeb8689a",
        ),
        (ControlQos::SEND_GOAL_RIHS01, "0f117248cbe8f14039ef077c29716ebdfaebcf07b55539fc798591b231ca6742"),
        (ControlQos::GET_RESULT_RIHS01, "131c0484088350f36e22f73b0e65ae2cce7350337fa4843fbbf95f6116f43838"),
        (ControlQos::FEEDBACK_RIHS01, "509605b09dd6de7514326e102088aa11d10a16f133ae7ceb76c81b021e0b776e"),
        (
            lyrical::lifecycle_msgs::msg::TransitionEvent::RIHS01,
            "78b19e2be41a797fc009c96bda68944182edabec7852cccd928a40bc06f6f9d7",
        ),
    ];
    for (own, expected) in cases {
        assert_eq!(own, format!("RIHS01_{expected}"));
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
