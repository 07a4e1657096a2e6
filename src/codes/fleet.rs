//! Catalogue of the message codes of `metaplan-fleet`.

/// Codes in order, each with meaning, cause and remedy.
pub const CODES: &[[&str; 4]] = &[
    [
        "N300",
        "The directory of missions cannot be used.",
        "It cannot be read, or has no manifest `*.toml`.",
        "Give `--missions DIR` with one manifest for each kind of robot.",
    ],
    [
        "N301",
        "Metrics cannot be served.",
        "The address of `--metrics` is in use, or is not one of this machine.",
        "Give another address, such as `127.0.0.1:9464`.",
    ],
    [
        "N302",
        "Signals cannot be heard.",
        "The operating system refuses a handler.",
        "The message says why; a worker could not end in order without it.",
    ],
    [
        "N310",
        "The directory of a fleet cannot be used.",
        "Another process has it, it cannot be written, or its file is damaged.",
        "One process at a time has a directory; several workers need NATS.",
    ],
    [
        "N311",
        "NATS cannot be used.",
        "No server answers, it refuses the user, JetStream is off, or there are fewer servers than replicas.",
        "Begin `nats-server -js`; with `--replicas 3` there must be three servers of one cluster.",
    ],
    [
        "N312",
        "The log of a fleet cannot be read or written.",
        "The servers are away, or have no room.",
        "What was acknowledged is safe; begin the command again when they are back.",
    ],
    [
        "N313",
        "Standard output cannot be written.",
        "The disk is full, or the file is gone.",
        "Begin again with `--after DECISION`, the last one that was written.",
    ],
    [
        "N314",
        "A line was not understood.",
        "A line is `ROBOT EVENT`; a name has up to 64 letters, digits, `-` and `_`.",
        "Correct the lines that the messages name; all others were stored.",
    ],
    [
        "N320",
        "An event was refused, or a robot does not go on.",
        "The robot is not enrolled, its mission is unknown or has changed, or the message has the id of another robot.",
        "The message says which; the event has changed nothing, and a robot that does not go on keeps its events.",
    ],
];
