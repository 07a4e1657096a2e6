//! Catalogue of the message codes of `metaplan-fleet`.

pub const CODES: &[[&str; 4]] = &[
    [
        "N300",
        "The directory of missions cannot be used.",
        "It cannot be read or has no manifest `*.toml`.",
        "Use `--missions DIR` with one manifest per kind of robot.",
    ],
    [
        "N301",
        "Metrics cannot be served.",
        "The address of `--metrics` is in use, or is not one of this machine.",
        "Use another address, such as `127.0.0.1:9464`.",
    ],
    [
        "N302",
        "The signal handler cannot be installed, or threads cannot be started.",
        "The operating system refuses a handler or a thread.",
        "The message gives the reason. Without the handler a worker cannot shut down in order.",
    ],
    [
        "N310",
        "The directory of a fleet cannot be used.",
        "Another process uses it, it cannot be written, or its file is damaged.",
        "Only one process at a time can use a directory. Several workers need NATS.",
    ],
    [
        "N311",
        "NATS cannot be used.",
        "No server responds, the user is refused, JetStream is disabled, or there are fewer servers than replicas.",
        "Start `nats-server -js`. `--replicas 3` requires a cluster of three servers. `--wait` sets how long to wait for servers that are starting.",
    ],
    [
        "N312",
        "The log of a fleet cannot be read or written.",
        "The servers are unreachable or have no space, or the disk of a fleet in a directory is full.",
        "Acknowledged events are safe. Start the command again when the servers are available, or when there is space.",
    ],
    [
        "N313",
        "Standard output cannot be written.",
        "The disk is full, or the file was removed.",
        "Start again with `--after DECISION`, where DECISION is the last decision written.",
    ],
    [
        "N314",
        "A line cannot be parsed.",
        "A line has the form `ROBOT EVENT`. A name has up to 64 letters, digits, `-` and `_`.",
        "Correct the lines in the messages. All other lines were stored.",
    ],
    [
        "N315",
        "An event was not stored.",
        "It is longer than the servers accept (`max_payload`, 1 MB unless it is set).",
        "Send a shorter event, or raise `max_payload`. All other events were stored.",
    ],
    [
        "N320",
        "An event was refused, or a robot is suspended.",
        "The robot is not enrolled, its mission is unknown or has changed, or the message has the id of another robot. Warnings are missing if standard error is not read for some time.",
        "The message gives the reason. A refused event has changed nothing, and a suspended robot keeps its events.",
    ],
];
