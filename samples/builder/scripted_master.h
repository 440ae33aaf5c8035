/// A master that does exactly what a scenario tells it, in virtual time, in the way of any master (master_way.h).
///
/// While the cyclic task runs, every call that lets time pass also sends the process-data frames that fall due.
#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "decoder/base/ids.h"
#include "samples/builder/master_way.h"
#include "samples/builder/recorder.h"
#include "samples/builder/simulated_bus.h"

namespace ecaudit::samples {

/// The packets of one frame.
struct FrameIds {
  std::optional<PacketId> sent{};
  std::optional<PacketId> returned{};
  std::optional<PacketId> again{};  ///< a second returned copy
};

/// What came back for one datagram.
struct Answer {
  Bytes data{};
  std::uint16_t wkc = 0;
  std::uint16_t adp = 0;
  bool lost = false;
  FrameIds frame{};
};

/// How an AL request ended.
struct AlAnswer {
  bool reached = false;
  bool error = false;
  std::uint16_t status = 0;
  std::uint16_t code = 0;
  FrameIds request{};      ///< the write of AL Control
  FrameIds status_read{};  ///< the last read of AL Status
};

struct SdoAnswer {
  bool done = false;
  std::uint32_t abort_code = 0;
  Bytes data{};
  FrameIds request{};
  FrameIds response{};
};

/// One process-data frame that differs from the others.
struct CycleChange {
  TimeNs shift = 0;  ///< sent later (or earlier)
  bool skip = false;
  bool lose = false;         ///< the returned copy never comes
  bool twice = false;        ///< it comes twice
  bool circulating = false;  ///< it comes with the circulating bit set
  std::optional<std::size_t>
      frame{};  ///< of a cycle of several frames only this one; else all are skipped, or the first lost
};

struct CyclicTask {
  TimeNs cycle = 1'000'000;
  bool distributes_time = false;  ///< 0x0910 of the first slave, as is the master's way
  bool reads_al_status = false;   ///< BRD 0x0130 behind
  /// Called before each cycle with its number, to change outputs; may be empty.
  std::function<void(int cycle)> before_cycle{};
};

class ScriptedMaster {
 public:
  ScriptedMaster(SimulatedBus& bus, Recorder& recorder, TimeNs start, const MasterWay& way = WayOf("soem"));

  // --- time
  [[nodiscard]] TimeNs now() const { return now_; }
  void Wait(TimeNs ns) { WaitUntil(now_ + ns); }
  void WaitUntil(TimeNs time);

  // --- single frames and datagrams
  Answer Aprd(std::size_t position, std::uint16_t ado, std::size_t length);
  Answer Apwr(std::size_t position, std::uint16_t ado, Bytes data);
  Answer Fprd(std::uint16_t station, std::uint16_t ado, std::size_t length);
  Answer Fpwr(std::uint16_t station, std::uint16_t ado, Bytes data);
  Answer Brd(std::uint16_t ado, std::size_t length);
  Answer Bwr(std::uint16_t ado, Bytes data);
  /// A slave, addressed as is the master's way.
  Answer Read(std::size_t position, std::uint16_t ado, std::size_t length);
  Answer Write(std::size_t position, std::uint16_t ado, Bytes data);
  /// Any datagrams in one frame; a frame that does not return is repeated. One answer each.
  std::vector<Answer> Exchange(std::vector<Datagram> datagrams);
  /// The next `count` frames do not come back.
  void LoseNext(int count) { lose_next_ = count; }
  /// The next frame comes back twice.
  void DoubleNext() { double_next_ = true; }
  /// Any bytes on the wire at this moment, as if from the master (and not answered).
  PacketId Foreign(Bytes packet);

  // --- start-up
  /// Resets all slaves, counts them, gives addresses, reads identity and mailbox words from the EEPROMs.
  void Scan();
  /// Reads the EEPROM; `word` is a word address. Two words.
  std::uint32_t ReadEeprom(std::size_t position, std::uint16_t word);
  void SetUpMailbox(std::size_t position);
  /// SM2 and SM3 with the lengths of the default PDOs, or with those given.
  void SetUpProcessData(std::size_t position, std::optional<std::uint16_t> output_bytes = {},
                        std::optional<std::uint16_t> input_bytes = {});
  /// Disables a sync manager, so that its settings can be written.
  void DisableSyncManager(std::size_t position, int number);
  /// FMMUs of all slaves: outputs of all behind each other, then inputs.
  void MapProcessImage();
  /// A slave has joined the line there: it will have this station address, all others keep what they have.
  void Joined(std::size_t position, std::uint16_t station);
  /// Process data of one more slave, behind those of the others.
  void MapBehind(std::size_t position);
  /// Process data of one slave, where they are.
  void MapAgain(std::size_t position);
  /// Everything up to PREOP; up to SAFEOP (with mapped process image); up to OP (with running cyclic task).
  void BringToPreop();
  void BringToSafeop();
  void BringToOp(CyclicTask task = {});
  /// Leads all slaves from the state they are in down to INIT; the cyclic task stops in SAFEOP.
  void ShutDown();

  // --- AL
  [[nodiscard]] std::uint16_t station(std::size_t position) const {
    return position < stations_.size() ? stations_[position]
                                       : static_cast<std::uint16_t>(way_.first_station + position);
  }
  /// Writes AL Control and nothing else.
  FrameIds Request(std::size_t position, std::uint16_t control);
  FrameIds RequestAll(std::uint16_t control);
  /// Writes AL Control as is the master's way, and polls until the state or an error appears, or `timeout` passed.
  AlAnswer ChangeState(std::size_t position, Al state, TimeNs timeout = 2'000'000'000);
  AlAnswer Poll(std::size_t position, std::uint8_t state, TimeNs timeout = 2'000'000'000);
  /// Acknowledges an error by requesting the present state with bit 4.
  AlAnswer Acknowledge(std::size_t position, Al present);

  // --- mailbox
  SdoAnswer Upload(std::size_t position, std::uint16_t index, std::uint8_t subindex, bool complete = false);
  SdoAnswer Download(std::size_t position, std::uint16_t index, std::uint8_t subindex, Bytes data,
                     bool complete = false);
  /// Writes any mailbox content; the header is added. False when the mailbox was full.
  Answer WriteMailbox(std::size_t position, std::uint8_t type, Bytes service);
  /// Polls until a message is there; nothing after `timeout`.
  std::optional<Bytes> ReadMailbox(std::size_t position, TimeNs timeout, FrameIds* frame = nullptr);

  // --- distributed clocks
  /// Measures delays, sets offsets so that the first slave's time is the virtual time, and sends `bursts` FRMWs.
  void SetUpClocks(int bursts = 20);
  /// SYNC0 of a slave: start time rounded up to whole cycles.
  void StartSync0(std::size_t position, std::uint32_t cycle_ns);

  // --- cyclic task
  void StartCyclic(CyclicTask task);
  void StopCyclic() { running_ = false; }
  void Cycles(int count);
  /// Number of the next cycle, from 0.
  [[nodiscard]] int next_cycle() const { return cycle_number_; }
  void ChangeCycle(int number, CycleChange change) { changes_[number] = change; }
  /// Output bytes of a slave in all further frames.
  void SetOutputs(std::size_t position, Bytes outputs);
  [[nodiscard]] Bytes& outputs(std::size_t position) { return outputs_.at(position); }
  /// Inputs of a slave as last received.
  [[nodiscard]] Bytes inputs(std::size_t position) const;
  [[nodiscard]] const FrameIds& last_cyclic() const { return last_cyclic_; }
  [[nodiscard]] std::uint16_t last_cyclic_wkc() const { return last_cyclic_wkc_; }

 private:
  struct Image {
    std::uint32_t output_offset = 0;
    std::uint16_t output_bytes = 0;
    std::uint32_t input_offset = 0;
    std::uint16_t input_bytes = 0;
  };

  using Datagrams = std::vector<Datagram>;

  Answer One(Cmd command, std::uint16_t adp, std::uint16_t ado, Bytes data);
  std::optional<Datagrams> SendOnce(const Datagrams& datagrams, FrameIds& ids);
  /// A datagram to or from a slave, addressed as is the master's way.
  [[nodiscard]] Datagram Addressed(std::size_t position, bool write, std::uint16_t ado, Bytes data) const;
  [[nodiscard]] Datagram TimeDatagram() const;
  [[nodiscard]] Datagrams ProcessDatagrams() const;
  void TakeProcessData(const Datagrams& back);
  void MakeRoom();
  void RunCycle();
  void NumberDatagrams(Datagrams& datagrams, bool cyclic);
  void ChangeAll(Al state);
  [[nodiscard]] std::uint16_t ControlFor(Al state) const;
  [[nodiscard]] bool HasMail(std::size_t position);
  SdoAnswer Converse(std::size_t position, Bytes sdo);
  std::optional<Bytes> AwaitSdo(std::size_t position, SdoAnswer& answer);

  SimulatedBus& bus_;
  Recorder& recorder_;
  MasterWay way_;
  TimeNs now_;
  TimeNs ready_at_ = 0;  // not before this may the next acyclic frame leave
  Jitter jitter_{0xEC};
  std::optional<std::uint8_t> index_;         // last one given
  std::optional<std::uint8_t> cyclic_index_;  // likewise, where process data have a counter of their own
  bool scanning_ = false;
  int lose_next_ = 0;
  bool double_next_ = false;
  bool circulate_next_ = false;

  std::vector<std::uint16_t> stations_;  // where slaves have joined: of all
  std::map<std::size_t, std::uint8_t> mailbox_counter_;
  std::map<std::size_t, std::uint16_t> aliases_;  // of slaves that answer to them
  std::vector<Image> image_;
  std::map<std::size_t, Bytes> outputs_;
  Bytes last_image_;

  CyclicTask task_;
  bool running_ = false;
  TimeNs first_cycle_ = 0;
  int cycle_number_ = 0;
  int cycles_since_start_ = 0;
  std::map<int, CycleChange> changes_;
  FrameIds last_cyclic_;
  std::uint16_t last_cyclic_wkc_ = 0;
};

}  // namespace ecaudit::samples
