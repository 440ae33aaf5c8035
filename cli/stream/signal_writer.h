/// Writes process data by name: a row for each frame that carries some, a column for each signal.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <unordered_map>
#include <vector>

#include "analyzers/model/bus_model.h"
#include "analyzers/signals/layout_guess.h"
#include "cli/stream/row_tape.h"
#include "cli/stream/signal_columns.h"
#include "cli/stream/stream_formats.h"
#include "cli/stream/stream_run.h"
#include "decoder/track/events.h"

namespace ecaudit::cli {

struct SignalOptions {
  SignalChoice choice;
  bool changes = false;        ///< rows only where a value differs from the last one shown
  std::uint64_t every = 1;     ///< of the rows of each kind of frame, the first of every N
  SignalSink* sink = nullptr;  ///< takes the rows in place of the targets' formats; outlives the writer
};

class SignalWriter final : public LineWriter {
 public:
  explicit SignalWriter(SignalOptions options) : options_(std::move(options)), columns_(options_.choice) {}

  [[nodiscard]] std::span<const OutputFormat> formats() const override { return StreamFormats::OfSignals().outputs(); }
  [[nodiscard]] Depth depth() const override { return Depth::kSlaves; }
  /// With the places that an earlier pass inferred.
  [[nodiscard]] const AnalysisOptions& Adapt(const AnalysisOptions& options) override;
  /// The columns stand above the first row, so all of them must be known by then. Rows are kept until they are; where
  /// they cannot be kept, the capture is read once more.
  [[nodiscard]] bool learns() const override { return true; }
  [[nodiscard]] bool learns_again() const override { return again_; }
  void BeginLearning(Observation& observation, const StreamContext& context) override;
  [[nodiscard]] std::optional<Error> EndLearning(Console& console) override;
  [[nodiscard]] bool kept() const override { return keeps_; }
  [[nodiscard]] std::optional<Error> WriteKept(const StreamContext& context) override;
  void Begin(Observation& observation, const StreamContext& context) override;
  void End() override;
  [[nodiscard]] bool ShowsUnmet(std::span<const SlaveSelector> selectors) const override;
  /// What comes later shows nothing about what was before.
  [[nodiscard]] bool stops_at_range_end() const override { return true; }

  // What is received.
  void On(const track::LogicalAccess& access);
  void On(const track::SlaveAccess& access);
  void On(const model::ProcessCycle& cycle);
  void On(const model::ProcessDataUnplaced& event);

 private:
  using Content = RowCell::Content;
  /// The last value of a state, command or meaning column.
  struct Word {
    std::optional<std::uint64_t> raw;  ///< unset: nothing yet
    const device::DeviceDescription* family = nullptr;
  };
  /// The frame whose row is being put together.
  struct Row {
    FrameRef sent, returned;
    std::uint64_t kind = 0;  ///< of the first datagram with process data; 0: none yet
    std::optional<std::uint64_t> dc_time;
    std::vector<std::uint32_t> filled;  ///< columns, in the order in which they were

    [[nodiscard]] const FrameRef& frame() const { return returned.seen() ? returned : sent; }
  };

  /// Columns that a row has.
  struct KeptLayout {
    std::uint64_t kind = 0;
    std::vector<std::uint32_t> columns;  ///< as numbered before they were sorted
    std::vector<std::uint32_t> places;   ///< where they are now
  };
  /// The row to which a row on the tape is stored as a difference.
  struct KeptBefore {
    std::uint64_t number = 0, time = 0, dc_time = 0;
    std::vector<std::uint64_t> raw;  ///< by column, as numbered before they were sorted
  };

  void ReportOddities(Console& console) const;
  [[nodiscard]] std::optional<std::uint32_t> LayoutOfRow();
  void KeepRow();
  void KeepCell(std::uint32_t column);
  void KeepNumbers(std::span<const std::uint32_t> columns);
  void TakeRow();
  void BeginPass(Observation& observation, const StreamContext& context);
  /// False when the frame is not to be shown.
  bool EnterRow(const FrameRef& sent, const FrameRef& returned);
  void EndRow();
  [[nodiscard]] bool Changed();
  RowCell& Fill(std::uint32_t column);
  void FillBytes(std::uint32_t column, ByteSpan bytes);
  void ShowDatagram(const track::LogicalAccess& access);
  [[nodiscard]] std::string WhyUnknown() const;
  void OpenSinks();
  void WriteRow();
  void RenewWord(std::uint32_t column);

  SignalOptions options_;
  SignalColumns columns_;
  bool learning_ = false;
  bool again_ = false;
  std::optional<signals::LayoutGuess> guess_;           ///< of the first pass
  std::optional<signals::LayoutGuess::Found> guessed_;  ///< counts from the second pass on

  // Rows that were read and not written yet.
  bool keeps_ = false;
  RowTape tape_;
  std::vector<KeptLayout> layouts_;
  std::unordered_map<std::uint64_t, std::uint32_t> layout_of_kind_;  ///< the last one
  std::vector<const device::DeviceDescription*> kept_families_;
  std::vector<ColumnKind> kept_kinds_;  ///< of columns, as numbered before they were sorted
  KeptBefore before_;

  bool dc_seen_ = false;  ///< a frame carries both process data and the time of the reference clock

  // Of the current pass.
  const StreamContext* context_ = nullptr;
  AnalysisOptions model_options_;
  const track::Network* network_ = nullptr;
  bool in_range_ = false;   ///< the datagram at hand is to be shown
  std::uint64_t kind_ = 0;  ///< of the datagram at hand
  Row row_;
  std::vector<RowCell> cells_;
  std::vector<RowCell> shown_;                              ///< as last written, for --changes
  std::vector<const device::DeviceDescription*> families_;  ///< of state, command and meaning columns
  std::vector<Word> words_;                                 ///< likewise
  std::vector<std::string> texts_;                          ///< likewise, the meaning of words_
  std::vector<std::uint32_t> word_columns_;                 ///< those columns
  std::vector<std::uint8_t> scratch_;
  SignalTable table_;
  std::vector<std::unique_ptr<SignalSink>> sinks_;  ///< by target; none with options_.sink
  std::unordered_map<std::uint64_t, std::uint64_t> rows_of_kind_;
};

}  // namespace ecaudit::cli
