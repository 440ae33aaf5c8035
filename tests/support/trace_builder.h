/// Scenarios as text or as C++ calls, turned into the outbound and returned frames that a capture would hold.
///
/// A `.trace` file has one frame a line; `#` begins a comment. This is the whole language:
///
///   @slaves 1 profile=kollmorgen-akd-2011     # slaves on the bus; key=value words are kept as attributes
///   +0us    FPRD 0x1001:0x0130  02 00        wkc=1   # the data of a read is what came back
///   +500us  FPWR 0x1001:0x0120  08 00        wkc=1   # the data of a write is what the master sent
///   +1ms    BRD 0x0130          02 00                # without wkc=: every slave meant takes part
///   +1ms    LRW 0x10000  01 02 -> 03 04      wkc=3  &  FRMW 0x1001:0x0910  00 00 00 00   wkc=1
///   +1ms    FPRD 0x1001:0x0130  02 00  @lost         # never comes back
///
/// A line is TIME DATAGRAM { & DATAGRAM }. A line that ends with `&`, or whose next line begins with `&`, goes on
/// there.
///
/// TIME    +T: T after the line before; T (no plus): T after the start. Units ns, us, ms, s.
/// DATAGRAM  COMMAND ADDRESS [DATA [-> DATA]] {key=value} {@word}
/// COMMAND APRD ... FRMW, NOP, any case.
/// ADDRESS AP.. and ARMW: POSITION:ESC (position 0, 1, ...; sent as 0, 0xFFFF, ...).  FP.. and FRMW: STATION:ESC.
///         BRD BWR BRW: ESC, or ADP:ESC.  LRD LWR LRW: the logical address.  NOP: ADP:ESC or nothing.
///         Decimal or 0x.
/// DATA    bytes, two hexadecimal digits each, blanks between. Of a read (and ARMW, FRMW) it is the returned data and
///         zeros are sent; of a write or LRW, APRW, ... it is sent and comes back unchanged. `A -> B`: A is sent, B
///         comes back. `time+N` stands for eight bytes: N plus the frame's time since the start in ns, a system time.
/// key=    wkc= of the returned copy; len= bytes of data when there are less or none (filled with 00); idx= index byte
///         (default: counts up per frame); irq= event field of the returned copy, sirq= as sent (default 0); adp= first
///         address half as sent; radp= as returned; swkc= working counter as sent (default 0). times=N: N such frames,
///         one after the other; rtt=T time until the return; mark=NAME remembers the frame, see Trace::Sent(); vlan=,
///         port= of the frame.
/// @word   @lost, @out-only: no returned copy. @returned-only: no outbound copy. @missed: neither; there is a
///         capture gap there. @twice: the returned copy comes twice.
///         @circulating: the circulating bit is set in the returned copy. @cut=N: the packets are cut to N bytes by
///         the snap length. @no-time: without time stamp.
/// Instead of a datagram: `RAW hex...` is one packet with exactly these bytes; `OTHER` is a packet of a foreign
/// protocol; `RETURN NAME` is the returned copy of the (lost) frame marked NAME, arriving now.
///
/// Directives, valid for all lines below:
///   @slaves N [key=value...]   slaves on the bus (default 1): added to the address by AP.. and broadcasts
///   @ack wkc=N                 returned working counter of lines without wkc= (`@ack wkc=auto`: back to the default,
///   that
///                              every slave meant takes part: +1 for a read or a write, +3 for both at once)
///   @out-only, @returned-only, @both     which copies the capture holds
///   @mac XX:XX:XX:XX:XX:XX     source address of the master (default 01:01:01:01:01:01)
///   @rtt T                     time until the return (default 30us)
///   @resolution T              time stamps are rounded down to T (default 1ns)
///   @no-time, @time            packets without and with time stamps
///   @two-interfaces            outbound copies on interface 0, returned ones on interface 1
///   @udp, @vlan TCI, @cooked, @cooked2   encapsulation; @ethernet: back to the plain one
///   @include FILE              the lines of FILE are read here, as if they stood in this file. FILE is relative to the
///                              including file, or else in tests/rules/common/
#pragma once

#include <cstdint>
#include <deque>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "decoder/base/result.h"
#include "samples/builder/frame_builder.h"
#include "tests/support/memory_source.h"

namespace ecaudit::test {

using samples::Bytes;
using samples::Cmd;

/// Time of the first line of every trace: 2024-01-01 00:00:00 UTC.
inline constexpr TimeNs kTraceStart = 1'704'067'200'000'000'000;

/// One datagram as the master sent it and as it came back.
struct TraceDatagram {
  Cmd command = Cmd::NOP;
  std::uint16_t adp = 0;  ///< as sent
  std::uint16_t ado = 0;
  Bytes sent;
  Bytes returned;
  std::optional<std::uint8_t> index;
  std::optional<std::uint16_t> wkc;           ///< returned; absent: the default of the trace
  std::optional<std::uint16_t> returned_adp;  ///< absent: as `adp`, plus the slaves for commands that count them
  std::uint16_t sent_wkc = 0;
  std::uint16_t irq = 0;
  std::uint16_t sent_irq = 0;
  bool circulating = false;
};

/// Which copies of a frame the capture holds.
enum class Copies : std::uint8_t { kBoth, kOutbound, kReturned, kNone };

class Trace;

/// One frame of a trace. Command functions add a datagram; Wkc(), Index(), Adp(), Irq() and SentIrq() change the last
/// one added. `data`: as DATA above. All functions return *this.
class TraceFrame {
 public:
  TraceFrame& Aprd(std::uint16_t position, std::uint16_t ado, Bytes returned);
  TraceFrame& Apwr(std::uint16_t position, std::uint16_t ado, Bytes sent);
  TraceFrame& Aprw(std::uint16_t position, std::uint16_t ado, Bytes sent, Bytes returned);
  TraceFrame& Fprd(std::uint16_t station, std::uint16_t ado, Bytes returned);
  TraceFrame& Fpwr(std::uint16_t station, std::uint16_t ado, Bytes sent);
  TraceFrame& Fprw(std::uint16_t station, std::uint16_t ado, Bytes sent, Bytes returned);
  TraceFrame& Brd(std::uint16_t ado, Bytes returned);
  TraceFrame& Bwr(std::uint16_t ado, Bytes sent);
  TraceFrame& Brw(std::uint16_t ado, Bytes sent, Bytes returned);
  TraceFrame& Lrd(std::uint32_t logical, Bytes returned);
  TraceFrame& Lwr(std::uint32_t logical, Bytes sent);
  TraceFrame& Lrw(std::uint32_t logical, Bytes sent, Bytes returned);
  TraceFrame& Armw(std::uint16_t position, std::uint16_t ado, Bytes returned);
  TraceFrame& Frmw(std::uint16_t station, std::uint16_t ado, Bytes returned);
  TraceFrame& Nop(Bytes data = {});
  TraceFrame& Add(TraceDatagram datagram);
  /// Instead of datagrams: a packet with exactly these bytes.
  TraceFrame& Raw(Bytes packet);

  TraceFrame& Wkc(std::uint16_t wkc);
  TraceFrame& Index(std::uint8_t index);
  TraceFrame& ReturnedAdp(std::uint16_t adp);
  TraceFrame& Irq(std::uint16_t irq);
  TraceFrame& SentIrq(std::uint16_t irq);
  TraceFrame& Circulating();

  TraceFrame& Lost();
  TraceFrame& ReturnedOnly();
  TraceFrame& Twice();
  TraceFrame& NoTime();
  TraceFrame& Rtt(TimeNs ns);
  TraceFrame& Cut(std::size_t bytes);
  TraceFrame& Mark(std::string name);

 private:
  friend class Trace;
  friend class TraceParser;

  TimeNs at_ = 0;  // since kTraceStart
  std::vector<TraceDatagram> datagrams_;
  std::optional<Bytes> raw_;
  Copies copies_ = Copies::kBoth;
  bool twice_ = false;
  bool has_time_ = true;
  TimeNs rtt_ = 30'000;
  std::size_t cut_ = 0;
  std::uint16_t slaves_ = 1;
  std::optional<std::uint16_t> default_wkc_;
  samples::MacAddress mac_{0x01, 0x01, 0x01, 0x01, 0x01, 0x01};
  samples::Encapsulation around_;
  bool two_interfaces_ = false;
  TimeNs resolution_ = 1;
  std::string mark_;
  std::string return_of_;  // mark of the frame whose returned copy this is
};

class Trace {
 public:
  Trace() = default;

  /// Reads the text form. The error names the line: "line 3: 0x10 is no byte". In an included file it names the line of
  /// the include, the file and its line.
  static Result<Trace> Parse(std::string_view text);
  /// Reads a file in the text form; errors begin with the path.
  static Result<Trace> Load(const std::string& path);

  /// Slaves on the bus, for frames added from now on.
  Trace& Slaves(std::uint16_t count);
  /// Which copies the capture holds, for frames added from now on.
  Trace& Direction(Copies copies);
  Trace& Mac(samples::MacAddress mac);
  /// Encapsulation of frames added from now on.
  Trace& Around(samples::Encapsulation around);
  Trace& NoTime(bool without = true);

  /// A new frame `us` microseconds after the start; the reference stays valid.
  TraceFrame& At(std::int64_t us);
  /// A new frame `us` microseconds after the one added before.
  TraceFrame& After(std::int64_t us);

  /// The packets in order of time; frames at the same time keep the order in which they were added.
  [[nodiscard]] std::vector<Packet> Packets() const;
  [[nodiscard]] std::unique_ptr<MemorySource> Source() const;
  /// Frame number of the outbound copy of the frame marked `name`; 0 when there is none.
  [[nodiscard]] FrameNo Sent(std::string_view name) const { return Find(name, false); }
  /// Frame number of its (first) returned copy; 0 when there is none.
  [[nodiscard]] FrameNo Returned(std::string_view name) const { return Find(name, true); }

  [[nodiscard]] std::uint16_t slaves() const { return settings_.slaves_; }
  /// key=value words of @slaves, for example {"profile", "kollmorgen-akd-2011"}.
  [[nodiscard]] const std::map<std::string, std::string>& attributes() const { return attributes_; }

 private:
  friend class TraceParser;
  struct Placed;

  [[nodiscard]] std::vector<Placed> Place() const;
  [[nodiscard]] FrameNo Find(std::string_view name, bool returned) const;
  TraceFrame& New(TimeNs at);

  TraceFrame settings_;  // defaults of frames to come
  std::deque<TraceFrame> frames_;
  std::map<std::string, std::string> attributes_;
};

}  // namespace ecaudit::test
