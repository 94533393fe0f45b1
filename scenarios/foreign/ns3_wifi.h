// The network of ns3_network.py: 802.11g without an access point, and the fates of its packets.
#include "ns3/mobility-helper.h"
#include "ns3/mobility-model.h"
#include "ns3/rng-seed-manager.h"
#include "ns3/string.h"
#include "ns3/txop.h"
#include "ns3/wifi-mac-queue.h"
#include "ns3/wifi-mac.h"
#include "ns3/wifi-net-device.h"
#include "ns3/yans-wifi-helper.h"

namespace wifi {
using namespace ns3;

constexpr int ALL = -1, ARRIVED = -1, MISSED = 4;  // ALL that lack it; other reasons are ns-3's
struct Fate { uint64_t packet; int host, reason; };
std::vector<Fate> fates;  // not settled yet
std::vector<Ptr<WifiNetDevice>> radios;

void Book(uint64_t packet, int host, int reason) {
  fates.push_back({packet, host, reason});
  Simulator::Stop();
}

bool Received(Ptr<NetDevice> radio, Ptr<const Packet> packet, uint16_t, const Address&) {
  Book(packet->GetUid(), radio->GetNode()->GetId(), ARRIVED);
  return true;
}

void Dropped(WifiMacDropReason reason, Ptr<const WifiMpdu> frame) {
  if (frame->GetHeader().IsData()) Book(frame->GetPacket()->GetUid(), ALL, reason);
}

void Sent(Ptr<const Packet> packet) {  // a broadcast arrives within 10 us (3 km), or never
  WifiMacHeader header;
  packet->PeekHeader(header);
  if (header.IsData() && header.GetAddr1().IsBroadcast())
    Simulator::Schedule(MicroSeconds(10), &Book, packet->GetUid(), ALL, MISSED);
}

void Start(int hosts, std::string mode, uint32_t seed) {
  Simulator::Destroy();  // the last run's
  RngSeedManager::SetSeed(seed);
  RngSeedManager::ResetNextStreamIndex();
  YansWifiPhyHelper phy;
  phy.SetChannel(YansWifiChannelHelper::Default().Create());
  phy.SetErrorRateModel("ns3::NistErrorRateModel");
  WifiMacHelper mac;
  mac.SetType("ns3::AdhocWifiMac");
  WifiHelper wifi;
  wifi.SetStandard(WIFI_STANDARD_80211g);
  wifi.SetRemoteStationManager("ns3::ConstantRateWifiManager", "DataMode", StringValue(mode));
  NodeContainer nodes(hosts);
  MobilityHelper().Install(nodes);
  auto devices = wifi.Install(phy, mac, nodes);
  fates.clear();
  radios.clear();
  for (int host = 0; host < hosts; ++host) {
    auto radio = radios.emplace_back(DynamicCast<WifiNetDevice>(devices.Get(host)));
    radio->SetReceiveCallback(MakeCallback(&Received));
    radio->GetMac()->TraceConnectWithoutContext("DroppedMpdu", MakeCallback(&Dropped));
    radio->GetPhy()->TraceConnectWithoutContext("PhyTxEnd", MakeCallback(&Sent));
  }
}

uint64_t Send(int from, int to, int size) {
  auto radio = radios[from];
  auto queue = radio->GetMac()->GetTxop()->GetWifiMacQueue();
  auto packet = Create<Packet>(size);
  auto taken = queue->GetTotalReceivedPackets();
  radio->Send(packet, to == ALL ? radio->GetBroadcast() : radios[to]->GetAddress(), 0x0800);
  if (queue->GetTotalReceivedPackets() == taken)  // ns-3 does not say that it was full
    Book(packet->GetUid(), ALL, WIFI_MAC_DROP_FAILED_ENQUEUE);
  return packet->GetUid();
}
}  // namespace wifi
