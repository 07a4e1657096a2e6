"""Reads and writes MCAP files with independent libraries: PyPI `mcap` and `mcap-ros2-support`.

`read FILE` prints every message, decoded by the schema in the file, as a line of JSON. `salvage FILE` prints the number of messages
of each topic in a file that can be truncated. `write FILE COMPRESSION` reads lines of JSON, [nanoseconds, array], and writes
diagnostics like `ros2 bag record`.
"""

import json
import sys
from collections import Counter

from mcap.exceptions import EndOfFile
from mcap.reader import make_reader
from mcap.records import Channel, Message
from mcap.stream_reader import StreamReader
from mcap.writer import CompressionType
from mcap_ros2.decoder import DecoderFactory
from mcap_ros2.writer import Writer

RULE = "=" * 80
DEFINITION = f"""# This message is used to send diagnostic information about the state of the robot.
std_msgs/Header header # for timestamp
DiagnosticStatus[] status # an array of components being reported on

{RULE}
MSG: diagnostic_msgs/DiagnosticStatus
byte OK=0
byte WARN=1
byte ERROR=2
byte STALE=3
byte level
string name
string message
string hardware_id
KeyValue[] values

{RULE}
MSG: diagnostic_msgs/KeyValue
string key
string value

{RULE}
MSG: std_msgs/Header
builtin_interfaces/Time stamp
string frame_id

{RULE}
MSG: builtin_interfaces/Time
int32 sec
uint32 nanosec
"""


def plain(value):
    """Converts a decoded message to JSON."""
    if isinstance(value, (list, tuple)):
        return [plain(element) for element in value]
    if isinstance(value, bytes):
        return list(value)
    if hasattr(value, "__slots__"):
        return {name: plain(getattr(value, name)) for name in value.__slots__}
    return value


def read(path):
    with open(path, "rb") as file:
        reader = make_reader(file, validate_crcs=True, decoder_factories=[DecoderFactory()])
        assert reader.get_header().profile == "ros2"
        # File order, so that the test can compare it with the order of writing.
        messages = reader.iter_messages(log_time_order=False)
        decoder = DecoderFactory()
        for schema, channel, message in messages:
            if channel.message_encoding == "cdr":
                data = plain(decoder.decoder_for("cdr", schema)(message.data))
            else:
                definition = json.loads(schema.data)
                data = json.loads(message.data)
                unknown = [name for name in definition["required"] if name not in data]
                assert schema.encoding == "jsonschema" and not unknown, (schema, unknown)
            print(json.dumps([channel.topic, schema.name, message.log_time, data]))


def salvage(path):
    topics, count = {}, Counter()
    with open(path, "rb") as file:
        try:
            for record in StreamReader(file, validate_crcs=True).records:
                if isinstance(record, Channel):
                    topics[record.id] = record.topic
                elif isinstance(record, Message):
                    count[topics[record.channel_id]] += 1
        except EndOfFile:
            pass
    print(json.dumps(count))


def write(path, compression):
    with open(path, "wb") as file:
        writer = Writer(file, chunk_size=500, compression=CompressionType[compression])
        schema = writer.register_msgdef("diagnostic_msgs/msg/DiagnosticArray", DEFINITION)
        text = writer.register_msgdef("std_msgs/msg/String", "string data\n")
        for line in sys.stdin:
            time, array = json.loads(line)
            # Messages of an unrelated topic, which a replay must skip.
            writer.write_message("/chatter", text, {"data": "of no concern"}, time)
            writer.write_message("/diagnostics", schema, array, time)
        writer.finish()


if __name__ == "__main__":
    {"read": read, "salvage": salvage, "write": write}[sys.argv[1]](*sys.argv[2:])
