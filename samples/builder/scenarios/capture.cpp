// Files that are incomplete, coarse or odd although the bus is healthy.
#include "samples/builder/scenarios/scenario.h"

namespace ecaudit::samples {
namespace {

// A healthy run of one drive, whatever the capture of it looks like.
void HealthyRun(Story& story, int cycles = 40) {
  story.Add(AkdDrive());
  story.master.Scan();
  story.master.BringToPreop();
  story.master.Upload(0, 0x1018, 1);
  story.master.BringToSafeop();
  story.master.BringToOp();
  story.EnableDrive(0);
  story.Move(0, 0, 4000, cycles);
  story.DisableDrive(0, 4000);
  story.master.ShutDown();
}

Bytes Arp(std::uint8_t host) {
  Bytes out{0xFF, 0xFF, 0xFF, 0xFF, 0xFF, 0xFF, 0x00, 0x11, 0x22, 0x33, 0x44, host, 0x08, 0x06,
            0x00, 0x01, 0x08, 0x00, 0x06, 0x04, 0x00, 0x01, 0x00, 0x11, 0x22, 0x33, 0x44, host,
            10,   0,    0,    host, 0,    0,    0,    0,    0,    0,    10,   0,    0,    254};
  out.resize(60, 0);
  return out;
}

// An IPv4 UDP packet to the discard port, with right checksums.
Bytes Udp(std::uint8_t host) {
  Bytes out{0x00, 0x11, 0x22, 0x33, 0x44, 0xFE, 0x00, 0x11, 0x22, 0x33, 0x44, host, 0x08, 0x00};
  Bytes ip{0x45, 0, 0, 46, 0, 0, 0, 0, 64, 17, 0, 0, 10, 0, 0, host, 10, 0, 0, 254};
  std::uint32_t sum = 0;
  for (std::size_t i = 0; i < ip.size(); i += 2) sum += static_cast<std::uint32_t>(ip[i] << 8U) | ip[i + 1];
  const auto checksum = static_cast<std::uint16_t>(~((sum & 0xFFFFU) + (sum >> 16U)) & 0xFFFFU);
  ip[10] = static_cast<std::uint8_t>(checksum >> 8U);
  ip[11] = static_cast<std::uint8_t>(checksum & 0xFFU);
  AppendBytes(out, ip);
  AppendBytes(out, Bytes{0xC0, 0x00, 0x00, 0x09, 0x00, 26, 0x00, 0x00});
  out.resize(60, 0x20);
  return out;
}

}  // namespace

Sample OutboundOnly() {
  Story story;
  story.capture.style.returned = false;
  HealthyRun(story);
  story.Expect("capture-one-direction");
  return story.Finish();
}

Sample ReturnedOnly() {
  Story story;
  story.capture.style.outbound = false;
  HealthyRun(story);
  story.Expect("capture-one-direction");
  return story.Finish();
}

Sample Truncated() {
  Story story;
  HealthyRun(story);
  story.capture.style.cut_file_by = 37;
  story.Expect("capture-truncated", -1, "the file ends inside its last packet");
  Sample sample = story.Finish();
  --sample.packets;
  return sample;
}

Sample SnapLength() {
  Story story;
  story.capture.style.snap_length = 64;
  HealthyRun(story);
  story.Expect("capture-snaplen", -1, "mailbox frames of 156 bytes are cut at 64");
  return story.Finish();
}

Sample CoarseTimestamps() {
  MasterWay way = WayOf("twincat");
  way.numbering = {.all = way.numbering.all, .others = way.numbering.others};
  Story story(way);
  story.capture.style.resolution = 6;
  story.capture.style.coarse_step = 1'000;
  HealthyRun(story);
  story.Expect("capture-timestamps", -1, "outbound and returned copies carry equal stamps");
  return story.Finish();
}

Sample PcapMicroseconds() {
  Story story;
  story.capture.style.format = FileFormat::kPcapMicro;
  HealthyRun(story, 10);
  return story.Finish();
}

Sample TwoInterfaces() {
  Story story;
  story.capture.style.two_interfaces = true;
  HealthyRun(story, 10);
  return story.Finish();
}

Sample EslProbe() {
  Story story;
  story.capture.around.esl = EslTag{};
  HealthyRun(story, 10);
  return story.Finish();
}

Sample VlanTagged() {
  Story story;
  story.capture.around.vlan_tags = {0xE005};  // priority 7, VLAN 5
  HealthyRun(story, 10);
  return story.Finish();
}

Sample UdpEncapsulated() {
  Story story;
  story.capture.around.udp = true;
  HealthyRun(story, 10);
  return story.Finish();
}

Sample NoEtherCat() {
  Story story;
  for (std::uint8_t host = 1; host <= 10; ++host) {
    story.master.Foreign(Arp(host));
    story.master.Wait(3'000'000);
    story.master.Foreign(Udp(host));
    story.master.Wait(5'000'000);
  }
  return story.Finish();
}

Sample ForeignTraffic() {
  Story story;
  story.Add(AkdDrive());
  ScriptedMaster& master = story.master;
  master.Foreign(Arp(1));
  master.Scan();
  master.Foreign(Udp(1));
  master.BringToPreop();
  for (std::uint8_t i = 2; i < 8; ++i) {
    master.Foreign(i % 2 == 0 ? Arp(i) : Udp(i));
    master.Poll(0, 2);
  }
  master.ShutDown();
  return story.Finish();
}

// Every fault is one frame that the master itself sends; the bus goes on between them.
Sample Malformed() {
  Story story;
  story.Add(AkdDrive());
  ScriptedMaster& master = story.master;
  master.Scan();
  master.BringToPreop();
  Datagram read;
  read.command = Cmd::FPRD;
  read.adp = master.station(0);
  read.ado = reg::kAlStatus;
  read.data = Bytes(2, 0);
  const auto inject = [&](const char* why, auto&& damage) {
    Bytes payload = EncodePayload({read, read});
    damage(payload);
    const PacketId packet = master.Foreign(EncodePacket(EtherCatFrame{}, payload, {}));
    story.Expect("frame-malformed", -1, FrameIds{.sent = packet}, why);
    master.Poll(0, 2);
  };
  // payload: header 0-1, first datagram 2-15 (length word at 8), second 16-29 (length word at 22)
  inject("the EtherCAT length reaches past the end of the frame",
         [](Bytes& p) { StoreLe(p, 0, static_cast<std::uint16_t>(0x1000 + 100)); });
  inject("the second datagram reaches past the EtherCAT length", [](Bytes& p) { StoreLe(p, 22, std::uint16_t{40}); });
  inject("the more flag is set on the last datagram", [](Bytes& p) { StoreLe(p, 22, std::uint16_t{0x8002}); });
  inject("command 77 does not exist", [](Bytes& p) { p[2] = 77; });
  inject("EtherCAT length 0", [](Bytes& p) { StoreLe(p, 0, std::uint16_t{0x1000}); });
  inject("no room for the EtherCAT header", [](Bytes& p) { p.resize(1); });
  master.ShutDown();
  return story.Finish();
}

}  // namespace ecaudit::samples
