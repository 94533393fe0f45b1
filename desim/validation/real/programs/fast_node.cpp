// A ROS 2 node's endpoints on Fast DDS, and topics.
//
//     fast_node NAME BEGIN WORD...
//
// BEGIN: seconds until it talks. WORDs: see peer_words.py. Settings are those of rmw_fastrtps 6.2,
// with UDP alone.
#include <fastdds/dds/domain/DomainParticipant.hpp>
#include <fastdds/dds/domain/DomainParticipantFactory.hpp>
#include <fastdds/dds/publisher/DataWriter.hpp>
#include <fastdds/dds/publisher/Publisher.hpp>
#include <fastdds/dds/subscriber/DataReader.hpp>
#include <fastdds/dds/subscriber/DataReaderListener.hpp>
#include <fastdds/dds/subscriber/SampleInfo.hpp>
#include <fastdds/dds/subscriber/Subscriber.hpp>
#include <fastdds/dds/topic/TopicDataType.hpp>
#include <fastdds/dds/topic/TypeSupport.hpp>
#include <fastdds/rtps/transport/UDPv4TransportDescriptor.h>
#include <time.h>
#include <unistd.h>

#include <algorithm>
#include <cstdio>
#include <map>
#include <sstream>
#include <thread>

using namespace eprosima::fastdds::dds;
namespace rtps = eprosima::fastrtps::rtps;
namespace transport = eprosima::fastdds::rtps;

static double now() {
  timespec time;
  clock_gettime(CLOCK_REALTIME, &time);
  return time.tv_sec + 1e-9 * time.tv_nsec;
}

static void sleep_until(double due) {
  double left = due - now();
  if (left > 0) {
    timespec pause{time_t(left), long(1e9 * (left - time_t(left)))};
    nanosleep(&pause, nullptr);
  }
}

// The bytes of a message as they are on the wire, behind the encapsulation.
struct Bytes : TopicDataType {
  Bytes(const std::string& name) {
    setName(name.c_str());
    m_typeSize = 1 << 20;
    m_isGetKeyDefined = false;
  }
  bool serialize(void* data, rtps::SerializedPayload_t* to) override {
    auto& text = *static_cast<std::string*>(data);
    to->encapsulation = CDR_LE;
    const unsigned char head[] = {0, 1, 0, 0};
    std::copy(head, head + 4, to->data);
    std::copy(text.begin(), text.end(), to->data + 4);
    to->length = text.size() + 4;
    return true;
  }
  bool deserialize(rtps::SerializedPayload_t* from, void* data) override {
    static_cast<std::string*>(data)->assign(reinterpret_cast<char*>(from->data) + 4,
                                            from->length - 4);
    return true;
  }
  std::function<uint32_t()> getSerializedSizeProvider(void* data) override {
    return [data] { return uint32_t(static_cast<std::string*>(data)->size() + 4); };
  }
  void* createData() override { return new std::string; }
  void deleteData(void* data) override { delete static_cast<std::string*>(data); }
  bool getKey(void*, rtps::InstanceHandle_t*, bool) override { return false; }
};

struct Hearing : DataReaderListener {
  void on_data_available(DataReader* reader) override {
    std::string text;
    SampleInfo info;
    while (reader->take_next_sample(&text, &info) == ReturnCode_t::RETCODE_OK) {
      std::stringstream words(text);
      std::string number, born;
      words >> number >> born;
      printf("heard %s %.9f %s\n", number.c_str(), now(), born.c_str());
      fflush(stdout);
    }
  }
};

template <class Quality>
static Quality quality(Quality given, int depth, bool reliable, bool latched) {
  given.endpoint().history_memory_policy = rtps::PREALLOCATED_WITH_REALLOC_MEMORY_MODE;
  given.data_sharing().off();
  given.reliability().kind = reliable ? RELIABLE_RELIABILITY_QOS : BEST_EFFORT_RELIABILITY_QOS;
  given.durability().kind = latched ? TRANSIENT_LOCAL_DURABILITY_QOS : VOLATILE_DURABILITY_QOS;
  given.history().kind = depth ? KEEP_LAST_HISTORY_QOS : KEEP_ALL_HISTORY_QOS;
  if (depth) given.history().depth = depth;
  return given;
}

struct Node {
  DomainParticipant* participant;
  Publisher* publisher;
  Subscriber* subscriber;
  std::map<std::string, Topic*> topics;

  Node(const char* name) {
    DomainParticipantQos settings;
    settings.name(name);
    settings.transport().use_builtin_transports = false;
    settings.transport().user_transports.push_back(
        std::make_shared<transport::UDPv4TransportDescriptor>());
    auto& builtin = settings.wire_protocol().builtin;
    builtin.readerHistoryMemoryPolicy = rtps::PREALLOCATED_WITH_REALLOC_MEMORY_MODE;
    builtin.writerHistoryMemoryPolicy = rtps::PREALLOCATED_WITH_REALLOC_MEMORY_MODE;
    participant = DomainParticipantFactory::get_instance()->create_participant(0, settings);
    publisher = participant->create_publisher(PUBLISHER_QOS_DEFAULT);
    subscriber = participant->create_subscriber(SUBSCRIBER_QOS_DEFAULT);
  }
  Topic* topic(const std::string& name, const std::string& type) {
    if (!topics.count(name)) {
      TypeSupport(new Bytes(type)).register_type(participant);
      topics[name] = participant->create_topic(name, type, TOPIC_QOS_DEFAULT);
    }
    return topics[name];
  }
  DataWriter* writer(const std::string& name, const std::string& type, int depth,
                     bool reliable = true, bool latched = false) {
    auto wanted = quality(DATAWRITER_QOS_DEFAULT, depth, reliable, latched);
    wanted.publish_mode().kind = SYNCHRONOUS_PUBLISH_MODE;
    return publisher->create_datawriter(topic(name, type), wanted);
  }
  void reader(const std::string& name, const std::string& type, int depth, bool reliable = true,
              bool latched = false, DataReaderListener* listener = nullptr) {
    subscriber->create_datareader(topic(name, type),
                                  quality(DATAREADER_QOS_DEFAULT, depth, reliable, latched),
                                  listener);
  }
};

static void add_ros_endpoints(Node& node, const std::string& host) {
  const std::string info = "rmw_dds_common::msg::dds_::ParticipantEntitiesInfo_";
  const std::string event = "rcl_interfaces::msg::dds_::ParameterEvent_";
  node.writer("ros_discovery_info", info, 1, true, true);
  node.reader("ros_discovery_info", info, 0, true, true);
  node.writer("rt/rosout", "rcl_interfaces::msg::dds_::Log_", 1000, true, true);
  node.writer("rt/parameter_events", event, 1000);
  node.reader("rt/parameter_events", event, 1000);
  const char* services[][2] = {{"GetParameters", "get_parameters"},
                               {"GetParameterTypes", "get_parameter_types"},
                               {"SetParameters", "set_parameters"},
                               {"SetParametersAtomically", "set_parameters_atomically"},
                               {"DescribeParameters", "describe_parameters"},
                               {"ListParameters", "list_parameters"}};
  for (auto& service : services) {
    const std::string type = std::string("rcl_interfaces::srv::dds_::") + service[0];
    node.reader("rq/" + host + "/" + service[1] + "Request", type + "_Request_", 10);
    node.writer("rr/" + host + "/" + service[1] + "Reply", type + "_Response_", 10);
  }
}

static void talk(DataWriter* writer, size_t size, double rate, double first) {
  for (long number = 0;; number++) {
    sleep_until(first + number / rate);
    char head[64];
    snprintf(head, sizeof head, "%ld %.9f ", number, now());
    std::string text(head);
    text.resize(size, 'x');
    writer->write(&text);
  }
}

int main(int count, char** words) {
  const double began = now();
  printf("began %.9f\n", began);
  fflush(stdout);
  Node node(words[1]);
  add_ros_endpoints(node, words[1]);
  const std::string type = "nav_msgs::msg::dds_::OccupancyGrid_";
  const double begin = std::max(began + atof(words[2]), now());
  for (int k = 3; k < count; k++) {
    std::vector<std::string> parts;
    std::stringstream word(words[k]);
    for (std::string part; getline(word, part, ':');) parts.push_back(part);
    const std::string topic = "rt" + parts[0];
    if (parts.size() == 5) {
      auto* writer = node.writer(topic, type, stoi(parts[3]), parts[4] == "1");
      const double rate = stod(parts[2]);
      if (rate > 0) std::thread(talk, writer, stoul(parts[1]), rate, begin).detach();
    } else {
      node.reader(topic, type, stoi(parts[1]), parts[2] == "1", false, new Hearing);
    }
  }
  for (;;) pause();
}
