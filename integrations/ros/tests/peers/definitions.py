"""ROS interface texts, written from the published interface tables and independently of `integrations/ros/interfaces`.

Only what neither `rosbags` nor `ros2-pyterfaces` brings along is written here, and the services of the standard
packages: `rosbags` knows the messages of Jazzy, but no services.
"""

MESSAGES: dict[str, str] = {
    "system_modes_msgs/msg/Mode": "string label",
    "system_modes_msgs/msg/ModeEvent": "uint64 timestamp\nMode start_mode\nMode goal_mode",
    "mros2_msgs/msg/QoS": """string objective_id
string objective_type
string objective_status
string selected_mode
bool always_improve
diagnostic_msgs/KeyValue[] qos""",
    "mavros_msgs/msg/State": """std_msgs/Header header
bool connected
bool armed
bool guided
bool manual_input
string mode
uint8 system_status""",
    "plansys2_msgs/msg/PlanItem": "float32 time\nstring action\nfloat32 duration",
    "plansys2_msgs/msg/Plan": "PlanItem[] items",
    "plansys2_msgs/msg/PlanArray": "Plan[] plan_array",
    "plansys2_msgs/msg/ActionExecutionInfo": """int8 status
builtin_interfaces/Time start_stamp
builtin_interfaces/Time status_stamp
string action_full_name
string action
string[] arguments
builtin_interfaces/Duration duration
float32 completion
string message_status""",
    "plansys2_msgs/msg/ActionExecution": """int16 type
string node_id
string action
string[] arguments
bool success
float32 completion
string status""",
    "plansys2_msgs/msg/ActionPerformerStatus": """builtin_interfaces/Time status_stamp
int8 state
string action
string[] specialized_arguments
string node_name""",
    "plansys2_msgs/msg/Param": "string name\nstring type\nstring[] sub_types",
    "plansys2_msgs/msg/Node": """uint8 node_type
uint8 expression_type
uint8 modifier_type
uint32 node_id
uint32[] children
string name
Param[] parameters
float64 value
bool negate""",
    "plansys2_msgs/msg/Tree": "Node[] nodes",
}

SERVICES: dict[str, str] = {
    "std_srvs/srv/Empty": "---",
    "std_srvs/srv/Trigger": "---\nbool success\nstring message",
    "std_srvs/srv/SetBool": "bool data\n---\nbool success\nstring message",
    "lifecycle_msgs/srv/ChangeState": "lifecycle_msgs/Transition transition\n---\nbool success",
    "lifecycle_msgs/srv/GetState": "---\nlifecycle_msgs/State current_state",
    "lifecycle_msgs/srv/GetAvailableStates": "---\nlifecycle_msgs/State[] available_states",
    "lifecycle_msgs/srv/GetAvailableTransitions": "---\nlifecycle_msgs/TransitionDescription[] available_transitions",
    "rcl_interfaces/srv/GetParameters": "string[] names\n---\nrcl_interfaces/ParameterValue[] values",
    "rcl_interfaces/srv/GetParameterTypes": "string[] names\n---\nuint8[] types",
    "rcl_interfaces/srv/ListParameters": "string[] prefixes\nuint64 depth\n---\nrcl_interfaces/ListParametersResult result",
    "rcl_interfaces/srv/DescribeParameters": "string[] names\n---\nrcl_interfaces/ParameterDescriptor[] descriptors",
    "rcl_interfaces/srv/SetParameters": "rcl_interfaces/Parameter[] parameters\n---\n"
    "rcl_interfaces/SetParametersResult[] results",
    "rcl_interfaces/srv/SetParametersAtomically": "rcl_interfaces/Parameter[] parameters\n---\n"
    "rcl_interfaces/SetParametersResult result",
    "action_msgs/srv/CancelGoal": "action_msgs/GoalInfo goal_info\n---\n"
    "int8 return_code\naction_msgs/GoalInfo[] goals_canceling",
    "system_modes_msgs/srv/ChangeMode": "string mode_name\n---\nbool success",
    "system_modes_msgs/srv/GetMode": "---\nstring current_mode",
    "system_modes_msgs/srv/GetAvailableModes": "---\nstring[] available_modes",
    "suave_msgs/srv/Task": "string task_name\n---\nbool success",
    "suave_msgs/srv/GetPath": "---\ngeometry_msgs/PoseArray path",
    "mros2_msgs/srv/MetacontrolFD": "string required_function_name\nstring required_fd_name\n---\nbool success",
    "mavros_msgs/srv/CommandBool": "bool value\n---\nbool success\nuint8 result",
    "mavros_msgs/srv/SetMode": "uint8 base_mode\nstring custom_mode\n---\nbool mode_sent",
    "plansys2_msgs/srv/GetPlan": "string domain\nstring problem\n---\nbool success\n"
    "plansys2_msgs/Plan plan\nstring error_info",
    "plansys2_msgs/srv/GetPlanArray": "string domain\nstring problem\n---\nbool success\n"
    "plansys2_msgs/PlanArray plan_array\nstring error_info",
    "plansys2_msgs/srv/ValidateDomain": "string domain\n---\nbool success\nstring error_info",
    "plansys2_msgs/srv/GetDomain": "std_msgs/Empty request\n---\nbool success\nstring domain\nstring error_info",
    "plansys2_msgs/srv/GetProblem": "std_msgs/Empty request\n---\nbool success\nstring problem\nstring error_info",
    "plansys2_msgs/srv/AddProblem": "string problem\n---\nbool success\nstring error_info",
    "plansys2_msgs/srv/AddProblemGoal": "plansys2_msgs/Tree tree\n---\nbool success\nstring error_info",
    "plansys2_msgs/srv/AffectNode": "plansys2_msgs/Node node\n---\nbool success\nstring error_info",
}

_NAVIGATE = """geometry_msgs/PoseStamped pose
string behavior_tree
---
{result}
---
geometry_msgs/PoseStamped current_pose
builtin_interfaces/Duration navigation_time
builtin_interfaces/Duration estimated_time_remaining
int16 number_of_recoveries
float32 distance_remaining{more}"""

ACTIONS: dict[str, str] = {
    "mros2_msgs/action/ControlQos": "mros2_msgs/QoS qos_expected\n---\n---\nmros2_msgs/QoS qos_status",
    "mros2_msgs/action/NavigateToPoseQos": """geometry_msgs/PoseStamped pose
string behavior_tree
mros2_msgs/QoS qos_expected
---
std_msgs/Empty result
---
geometry_msgs/PoseStamped current_pose
builtin_interfaces/Duration navigation_time
int16 number_of_recoveries
float32 distance_remaining
mros2_msgs/QoS qos_status""",
    "suave_msgs/action/SpiralSearch": "---\nfloat32 time_spent\nbool pipeline_found\n---\nfloat32 elapsed_time",
    "suave_msgs/action/FollowPipeline": "float32 timeout\n---\nfloat32 distance_inspected\nbool success\n"
    "bool timed_out\n---\nfloat32 distance_inspected",
    "suave_msgs/action/RechargeBattery": "---\nbool success\n---",
    "suave_msgs/action/RecoverThrusters": "---\nbool success\n---",
    "plansys2_msgs/action/ExecutePlan": "plansys2_msgs/Plan plan\n---\nbool success\n"
    "plansys2_msgs/ActionExecutionInfo[] action_execution_status\n---\n"
    "plansys2_msgs/ActionExecutionInfo[] action_execution_status",
    "nav2_msgs/action/NavigateToPose": _NAVIGATE.format(result="uint16 error_code\nstring error_msg", more=""),
}

# Differences of `rosbags` from Jazzy: the definition has char[16], and ROS reads char as uint8.
CORRECTED: dict[str, str] = {
    "service_msgs/msg/ServiceEventInfo": """uint8 event_type
builtin_interfaces/Time stamp
uint8[16] client_gid
int64 sequence_number"""
}

# Differences of a distribution or an older release.
VARIANTS: dict[str, dict[str, str]] = {
    "humble": {"nav2_msgs/action/NavigateToPose": _NAVIGATE.format(result="std_msgs/Empty result", more="")},
    "iron": {"nav2_msgs/action/NavigateToPose": _NAVIGATE.format(result="uint16 error_code", more="")},
    "rolling": {
        "nav2_msgs/action/NavigateToPose": _NAVIGATE.format(
            result="uint16 error_code\nstring error_msg",
            more="\nfloat32 position_tracking_error\nfloat32 heading_tracking_error",
        )
    },
    "lyrical": {
        "lifecycle_msgs/msg/TransitionEvent": """builtin_interfaces/Time stamp
lifecycle_msgs/Transition transition
lifecycle_msgs/State start_state
lifecycle_msgs/State goal_state"""
    },
    "plansys2_1": {
        "plansys2_msgs/action/ExecutePlan": """std_msgs/Empty request
---
bool success
string error_info
---
int32 seq_action
int32 total_actions
string current_action
float32 progress_current_action"""
    },
}
