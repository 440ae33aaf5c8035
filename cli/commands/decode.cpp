/// `ecaudit decode`: every datagram of a capture, in file order.
#include <algorithm>
#include <memory>
#include <span>
#include <vector>

#include "analyzers/model/bus_model.h"
#include "analyzers/options/device_files.h"
#include "cli/commands/command.h"
#include "cli/interrupt.h"
#include "cli/stream/datagram_text.h"
#include "cli/stream/stream_formats.h"
#include "cli/stream/stream_run.h"
#include "decoder/base/wrapping.h"
#include "decoder/esc/register_map.h"
#include "decoder/track/mailbox_window.h"

namespace ecaudit::cli {
namespace {

class DatagramWriter final : public LineWriter {
 public:
  [[nodiscard]] std::span<const OutputFormat> formats() const override {
    return StreamFormats::OfDatagrams().outputs();
  }
  /// What a slave is matters for its diagnosis messages only.
  [[nodiscard]] Depth depth() const override { return with_texts_ ? Depth::kSlaves : Depth::kFrames; }
  [[nodiscard]] const AnalysisOptions& Adapt(const AnalysisOptions& options) override {
    with_texts_ = options.files != nullptr && HasDiagnosisTexts(*options.files);
    return options;
  }
  [[nodiscard]] bool stops_at_range_end() const override { return true; }

  void Begin(Observation& observation, const StreamContext& context) override {
    pipeline_ = &observation.pipeline();
    observation.bus().Listen(Stage::kBeforeModel, *this, &DatagramWriter::On);
    if (with_texts_) {
      model_ = &observation.model();
    } else {
      observation.bus().Listen(Stage::kModel, *this, &DatagramWriter::OnPoll);
    }
    context_ = &context;
    table_ = {context.time_mode, context.settings.analysis.slave_names};
    for (LineTarget& target : context.targets) {
      sinks_.push_back(StreamFormats::OfDatagrams().At(target.format).datagrams(target.output, target.color));
      sinks_.back()->Begin(table_);
    }
  }

  void End() override {
    for (const auto& sink : sinks_) sink->End();
  }

 private:
  static bool HasDiagnosisTexts(const DeviceFiles& files) {
    return std::ranges::any_of(files.esi, [](const DeviceFiles::Esi& file) {
      return std::ranges::any_of(file.content.devices,
                                 [](const device::DeviceDescription& one) { return one.diagnosis_texts() != nullptr; });
    });
  }

  /// The events about single slaves have no subscriber here.
  void OnPoll(const track::AlPoll& poll) { poll.taken = true; }

  void On(const FrameSeen& seen) {
    const wire::FrameView& frame = seen.frame;
    const std::optional<std::int64_t> since_start = context_->source.SinceStart(frame.ref());
    const auto seconds = since_start ? std::optional(static_cast<double>(*since_start) / 1e9) : std::nullopt;
    if (!context_->range.Contains(frame.ref().number, seconds)) return;
    for (std::size_t i = 0; i < frame.size(); ++i) {
      DatagramRow row{frame,        frame[i],     seen.direction,   since_start,
                      std::nullopt, std::nullopt, context_->time(), nullptr};
      if (!Resolve(row)) continue;
      for (const auto& sink : sinks_) sink->Row(row);
    }
    if (context_->settings.slaves.empty() && IsUnsound(frame)) {
      for (const auto& sink : sinks_) sink->Unsound({frame, since_start, context_->time()});
    }
    for (const LineTarget& target : context_->targets) {
      if (!target.output.closed()) return;
    }
    InterruptFlag() = true;  // the reader has closed the output
  }

  /// Finds the slave that is addressed.
  /// @return false when --slave asks for others
  bool Resolve(DatagramRow& row) const {
    const wire::DatagramView& d = row.datagram;
    const track::Network& network = pipeline_->network();
    SlaveId slave = kNoSlave;
    if (wire::IsNodeAddressed(d.command())) {
      slave = network.slaves().AtStation(d.adp());
      if (slave != kNoSlave) {
        if (const SlavePos* position = network.slaves()[slave].position.if_known()) row.slave = *position;
      }
    } else if (wire::IsPositionAddressed(d.command())) {
      row.slave = PositionOf(row);
      if (row.slave) slave = network.slaves().AtPosition(*row.slave);
    }
    row.mailbox = MailboxOf(row, slave);
    if (row.mailbox && model_ != nullptr && slave < model_->size()) {
      const device::DeviceDescription* const profile = model_->slave(slave).profile;
      row.diagnosis_texts = profile != nullptr ? profile->diagnosis_texts() : nullptr;
    }
    if (context_->settings.slaves.empty()) return true;
    for (const SlaveSelector& selector : context_->settings.slaves) {
      if (!selector.by_address && row.slave && *row.slave == selector.value) return true;
      const std::uint16_t address = selector.by_address ? selector.value : selector.or_address;
      if (address != 0 && wire::IsNodeAddressed(d.command()) && d.adp() == address) return true;
    }
    return slave != kNoSlave && SelectsSlave(context_->settings.slaves, network, slave);
  }

  /// The mailbox that a datagram accesses from its first byte on, as far as the sync managers are in the capture.
  [[nodiscard]] std::optional<mailbox::Direction> MailboxOf(const DatagramRow& row, SlaveId slave) const {
    const wire::DatagramView& d = row.datagram;
    if (slave == kNoSlave || d.ado() < esc::kProcessRam) return std::nullopt;
    const track::MailboxWindow window = track::MailboxWindowOf(pipeline_->network().state(slave));
    const auto is_at = [&d](track::MailboxUse use, EscAddress start) {
      return use == track::MailboxUse::kOn && start == d.ado();
    };
    if (is_at(window.out_use, window.out_start) && wire::Writes(d.command())) return mailbox::Direction::kOut;
    if (is_at(window.in_use, window.in_start) && wire::Reads(d.command())) return mailbox::Direction::kIn;
    return std::nullopt;
  }

  /// The position that a position-addressed datagram means: 0 minus the address sent. Each slave passed adds one.
  [[nodiscard]] std::optional<SlavePos> PositionOf(const DatagramRow& row) const {
    const std::uint16_t* count = pipeline_->network().slave_count().if_known();
    const std::uint16_t adp = row.datagram.adp();
    std::optional<SlavePos> position;
    if (row.outbound()) {
      position = WrappingDifference(SlavePos{0}, adp);
    } else if (row.returned() && count != nullptr) {
      position = WrappingDifference(*count, adp);
    }
    if (position && count != nullptr && *position >= *count) return std::nullopt;  // beyond the last slave
    return position;
  }

  const Pipeline* pipeline_ = nullptr;
  const model::BusModel* model_ = nullptr;  ///< null: not needed
  bool with_texts_ = false;
  const StreamContext* context_ = nullptr;
  DatagramTable table_;
  std::vector<std::unique_ptr<DatagramSink>> sinks_;  ///< by target
};

class DecodeCommand : public Command {
 public:
  DecodeCommand() : Command("decode", "decode CAPTURE", "Show every datagram, one a line") {}

  void Declare(OptionSet& options) override {
    run_.Declare(options, StreamFormats::OfDatagrams());
    options.Footer(
        "\nColumns: frame (and datagram in it), seconds from the first packet or --time, -> sent or <- returned, "
        "command, slave\n"
        "addressed, address, bytes, working counter, content. --slave leaves out broadcasts and process data.\n"
        "Example: ecaudit decode --frames 740-760 trace.pcapng");
  }

  [[nodiscard]] ExitStatus Run(Console& console) override {
    DatagramWriter writer;
    return run_.Run(console, writer, name());
  }

 private:
  StreamRun run_;
};

}  // namespace

std::unique_ptr<Command> MakeDecodeCommand() {
  return std::make_unique<DecodeCommand>();
}

}  // namespace ecaudit::cli
