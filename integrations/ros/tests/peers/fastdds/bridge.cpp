// A participant of eProsima Fast DDS in the conventions of rmw_fastrtps, driven by lines: CDR goes in and out as hexadecimal
// text, so that one simulated robot speaks through either library. A request carries the GUID of the reader that waits for
// its reply as related_sample_identity, and a reply carries the identity of the request, as rmw_fastrtps does.
//
//   W id topic type depth transient_local        a writer          w id cdr             publishes
//   R id topic type depth transient_local        a reader          d id cdr             came in (output)
//   R id topic type depth transient_local 1      a reader of replies    a id identity cdr    a reply came in (output)
//   q id reader-id token cdr                     requests, by a writer and the reader of its replies
//   S token reader-guid writer-guid sequence     the request was written (output)
//   (requests come as) d id cdr identity                           r id identity cdr    replies to an identity
//   m id count                                                     endpoints matched, on change (output)
//   g hex                                                          the participant's GUID (output, first)
#include <fastdds/dds/domain/DomainParticipant.hpp>
#include <fastdds/dds/domain/DomainParticipantFactory.hpp>
#include <fastdds/dds/publisher/DataWriter.hpp>
#include <fastdds/dds/publisher/DataWriterListener.hpp>
#include <fastdds/dds/publisher/Publisher.hpp>
#include <fastdds/dds/subscriber/DataReader.hpp>
#include <fastdds/dds/subscriber/DataReaderListener.hpp>
#include <fastdds/dds/subscriber/SampleInfo.hpp>
#include <fastdds/dds/subscriber/Subscriber.hpp>
#include <fastdds/dds/topic/TopicDataType.hpp>
#include <fastdds/dds/topic/TypeSupport.hpp>
#include <fastdds/rtps/common/WriteParams.h>
#include <fastdds/rtps/transport/UDPv4TransportDescriptor.h>

#include <cstdio>
#include <cstring>
#include <iostream>
#include <map>
#include <memory>
#include <mutex>
#include <sstream>
#include <string>
#include <vector>

using namespace eprosima::fastdds::dds;
using namespace eprosima::fastrtps::rtps;
using Octets = std::vector<uint8_t>;

static std::string hex(const uint8_t* data, size_t size) {
    static const char* digits = "0123456789abcdef";
    std::string text;
    text.reserve(2 * size);
    for (size_t i = 0; i < size; i++) {
        text += digits[data[i] >> 4];
        text += digits[data[i] & 15];
    }
    return text;
}

static Octets octets(const std::string& text) {
    Octets found(text.size() / 2);
    for (size_t i = 0; i < found.size(); i++) found[i] = std::stoi(text.substr(2 * i, 2), nullptr, 16);
    return found;
}

// Output comes from the library's threads, too.
static std::mutex output;
static void say(const std::string& line) {
    std::lock_guard<std::mutex> guard(output);
    std::fwrite(line.data(), 1, line.size(), stdout);
    std::fputc('\n', stdout);
    std::fflush(stdout);
}

static std::string text_of(const GUID_t& guid) {
    return hex(guid.guidPrefix.value, 12) + hex(guid.entityId.value, 4);
}

static std::string text_of(const SampleIdentity& identity) {
    return text_of(identity.writer_guid()) + ":" + std::to_string(identity.sequence_number().to64long());
}

static GUID_t guid_of(const std::string& text) {
    const Octets all = octets(text);
    GUID_t guid;
    std::memcpy(guid.guidPrefix.value, all.data(), 12);
    std::memcpy(guid.entityId.value, all.data() + 12, 4);
    return guid;
}

static SampleIdentity identity_of(const std::string& text) {
    const size_t colon = text.find(':');
    const int64_t number = std::stoll(text.substr(colon + 1));
    SampleIdentity identity;
    identity.writer_guid(guid_of(text.substr(0, colon)));
    identity.sequence_number(SequenceNumber_t(static_cast<int32_t>(number >> 32), static_cast<uint32_t>(number)));
    return identity;
}

// A type whose samples are octets with their encapsulation header.
struct RawType : TopicDataType {
    explicit RawType(const std::string& name) {
        setName(name.c_str());
        m_typeSize = 65000;
        m_isGetKeyDefined = false;
        auto_fill_type_object(false);
        auto_fill_type_information(false);
    }
    bool serialize(void* data, SerializedPayload_t* payload) override {
        const Octets& raw = *static_cast<Octets*>(data);
        payload->length = raw.size();
        payload->encapsulation = CDR_LE;
        std::memcpy(payload->data, raw.data(), raw.size());
        return true;
    }
    bool deserialize(SerializedPayload_t* payload, void* data) override {
        static_cast<Octets*>(data)->assign(payload->data, payload->data + payload->length);
        return true;
    }
    std::function<uint32_t()> getSerializedSizeProvider(void* data) override {
        return [data] { return static_cast<uint32_t>(static_cast<Octets*>(data)->size()); };
    }
    void* createData() override { return new Octets; }
    void deleteData(void* data) override { delete static_cast<Octets*>(data); }
    bool getKey(void*, InstanceHandle_t*, bool) override { return false; }
};

struct OnWriter : DataWriterListener {
    std::string id;
    void on_publication_matched(DataWriter*, const PublicationMatchedStatus& status) override {
        say("m " + id + " " + std::to_string(status.current_count));
    }
};

struct OnReader : DataReaderListener {
    std::string id;
    bool replies = false;
    void on_subscription_matched(DataReader*, const SubscriptionMatchedStatus& status) override {
        say("m " + id + " " + std::to_string(status.current_count));
    }
    void on_data_available(DataReader* reader) override {
        Octets data;
        SampleInfo info;
        while (reader->take_next_sample(&data, &info) == ReturnCode_t::RETCODE_OK) {
            if (!info.valid_data) continue;
            if (replies) {
                // The client reads its own GUIDs out of this and drops what is meant for others.
                say("a " + id + " " + text_of(info.related_sample_identity) + " " + hex(data.data(), data.size()));
                continue;
            }
            // A request names the reader of its reply where its client says so, else its own writer.
            SampleIdentity identity = info.sample_identity;
            const GUID_t& wanted = info.related_sample_identity.writer_guid();
            if (wanted != GUID_t::unknown()) identity.writer_guid(wanted);
            say("d " + id + " " + hex(data.data(), data.size()) + " " + text_of(identity));
        }
    }
};

class Bridge {
public:
    explicit Bridge(int domain) {
        DomainParticipantQos qos = PARTICIPANT_QOS_DEFAULT;
        // UDP on loopback, and no shared memory: the other side has none.
        auto udp = std::make_shared<eprosima::fastdds::rtps::UDPv4TransportDescriptor>();
        udp->interfaceWhiteList.push_back("127.0.0.1");
        qos.transport().use_builtin_transports = false;
        qos.transport().user_transports.push_back(udp);
        participant = DomainParticipantFactory::get_instance()->create_participant(domain, qos);
        publisher = participant->create_publisher(PUBLISHER_QOS_DEFAULT);
        subscriber = participant->create_subscriber(SUBSCRIBER_QOS_DEFAULT);
        say("g " + text_of(participant->guid()));
    }

    ~Bridge() {
        participant->delete_contained_entities();
        DomainParticipantFactory::get_instance()->delete_participant(participant);
    }

    void obey(const std::string& line) {
        std::istringstream words(line);
        std::string verb, id;
        words >> verb >> id;
        if (verb == "W" || verb == "R") {
            std::string name, type;
            int depth, transient;
            bool replies = false;
            words >> name >> type >> depth >> transient;
            if (verb == "W") {
                open_writer(id, name, type, depth, transient);
            } else {
                words >> replies;
                open_reader(id, name, type, depth, transient, replies);
            }
        } else if (verb == "w") {
            std::string text;
            words >> text;
            Octets data = octets(text);
            writers.at(id)->write(&data);
        } else if (verb == "q") {
            std::string reader, token, text;
            words >> reader >> token >> text;
            Octets data = octets(text);
            WriteParams parameters;
            parameters.related_sample_identity().writer_guid(readers.at(reader)->guid());
            writers.at(id)->write(&data, parameters);
            const auto number = parameters.sample_identity().sequence_number().to64long();
            say("S " + token + " " + text_of(readers.at(reader)->guid()) + " " + text_of(writers.at(id)->guid()) + " " +
                std::to_string(number));
        } else if (verb == "r") {
            std::string identity, text;
            words >> identity >> text;
            Octets data = octets(text);
            WriteParams parameters;
            parameters.related_sample_identity(identity_of(identity));
            writers.at(id)->write(&data, parameters);
        } else {
            say("? " + line);
        }
    }

private:
    Topic* topic(const std::string& name, const std::string& type) {
        const std::string key = name + " " + type;
        if (!topics.count(key)) {
            TypeSupport support(new RawType(type));
            support.register_type(participant);
            topics[key] = participant->create_topic(name, type, TOPIC_QOS_DEFAULT);
        }
        return topics[key];
    }

    void open_writer(const std::string& id, const std::string& name, const std::string& type, int depth, int transient) {
        DataWriterQos qos = DATAWRITER_QOS_DEFAULT;
        qos.reliability().kind = RELIABLE_RELIABILITY_QOS;
        qos.durability().kind = transient ? TRANSIENT_LOCAL_DURABILITY_QOS : VOLATILE_DURABILITY_QOS;
        qos.history().depth = depth;
        qos.endpoint().history_memory_policy = PREALLOCATED_WITH_REALLOC_MEMORY_MODE;
        auto listener = std::make_unique<OnWriter>();
        listener->id = id;
        writers[id] = publisher->create_datawriter(topic(name, type), qos, listener.get());
        on_writers.push_back(std::move(listener));
    }

    void open_reader(const std::string& id, const std::string& name, const std::string& type, int depth, int transient,
                     bool replies) {
        DataReaderQos qos = DATAREADER_QOS_DEFAULT;
        qos.reliability().kind = RELIABLE_RELIABILITY_QOS;
        qos.durability().kind = transient ? TRANSIENT_LOCAL_DURABILITY_QOS : VOLATILE_DURABILITY_QOS;
        qos.history().depth = depth;
        qos.endpoint().history_memory_policy = PREALLOCATED_WITH_REALLOC_MEMORY_MODE;
        auto listener = std::make_unique<OnReader>();
        listener->id = id;
        listener->replies = replies;
        readers[id] = subscriber->create_datareader(topic(name, type), qos, listener.get());
        on_readers.push_back(std::move(listener));
    }

    DomainParticipant* participant;
    Publisher* publisher;
    Subscriber* subscriber;
    std::map<std::string, Topic*> topics;
    std::map<std::string, DataWriter*> writers;
    std::map<std::string, DataReader*> readers;
    std::vector<std::unique_ptr<OnWriter>> on_writers;
    std::vector<std::unique_ptr<OnReader>> on_readers;
};

int main(int count, char** arguments) {
    Bridge bridge(count > 1 ? std::atoi(arguments[1]) : 0);
    std::string line;
    while (std::getline(std::cin, line)) bridge.obey(line);
}
