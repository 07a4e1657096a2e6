//! Catalogue of the message codes of `metaplan-ros`.

pub const CODES: &[[&str; 4]] = &[
    [
        "N100",
        "`metaplan-ros` cannot start.",
        "The signal handler cannot be installed, `--mission` is missing, or `--journal` is given to a role without persistent state.",
        "Use `--mission FILE`. `--journal` is only for the manager and the reasoner.",
    ],
    [
        "N101",
        "An argument after `--ros-args` is wrong.",
        "An argument, a remapping rule, a parameter or a log level is malformed.",
        "Write rules as `from:=to` and parameters as `name:=value`.",
    ],
    [
        "N102",
        "A parameter file cannot be used.",
        "It cannot be read, is not YAML, or is not a parameter file.",
        "Write `node: {ros__parameters: {name: value}}`.",
    ],
    [
        "N103",
        "A parameter is wrong.",
        "Its value has another type (an error), or the node has no such parameter (a warning).",
        "Use the name that the message proposes.",
    ],
    [
        "N110",
        "An environment variable is wrong.",
        "`ROS_DOMAIN_ID` or the discovery range has an invalid value.",
        "Correct it, or unset it.",
    ],
    [
        "N111",
        "An environment variable is not supported.",
        "`ROS_STATIC_PEERS` and the discovery range `OFF` are not supported.",
        "Nothing, if discovery by multicast suffices.",
    ],
    [
        "N120",
        "No DDS participant can be created.",
        "There is no network, or no free port in the domain.",
        "Check the network and `ROS_DOMAIN_ID`.",
    ],
    [
        "N121",
        "A name is not a valid ROS 2 name.",
        "The name of a node, topic or service has characters that ROS 2 does not allow.",
        "Use letters, digits, `_` and `/`.",
    ],
    [
        "N122",
        "A topic, service or action cannot be created.",
        "The message gives the reason.",
        "Check its name and the network.",
    ],
    [
        "N130",
        "The settings cannot be used.",
        "`ros.toml` cannot be read or has errors.",
        "Correct the part that the message names.",
    ],
    [
        "N132",
        "Designs are not modes of the robot.",
        "The node of a function has no mode with the name of the design.",
        "Name the modes under `[functions.F.modes]` of the settings.",
    ],
    [
        "N133",
        "Functions or designs of the settings do not fit the mission.",
        "A table `[functions.F]` of the settings names no function, or one of its designs does not exist or has no steps.",
        "Correct the name, or add the steps.",
    ],
    [
        "N134",
        "A command is not allowed.",
        "The steps of a design execute a command, and the program was started without `--allow-commands`.",
        "Add `--allow-commands` if you trust the settings, or remove the command.",
    ],
    [
        "N135",
        "A diagnostic or a signal reports what the mission does not have.",
        "`component` or `attribute` of a table `[[diagnostics]]` or `[[signals]]` is not in the knowledge base.",
        "Correct the name.",
    ],
    [
        "N136",
        "The definition of a type is wrong.",
        "A definition in the table `[types]` of the settings cannot be read or parsed.",
        "Use the text of the type's `.msg`, `.srv` or `.action` file.",
    ],
    [
        "N140",
        "There are no designs to choose from.",
        "The mission of a reasoner has no knowledge base.",
        "Use a mission with `[knowledge]`.",
    ],
    [
        "N141",
        "The stored state of the reasoner cannot be used.",
        "Its file in the journal's directory is damaged, or cannot be written.",
        "Repair or remove the file.",
    ],
    [
        "N150",
        "The controller has given up.",
        "Five consecutive plans have failed.",
        "Find the cause in the log, correct it, and start the controller again.",
    ],
];
