/// The columns of `signals`: which there are, what they are called, and which of them a datagram fills.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <unordered_map>
#include <vector>

#include "analyzers/model/process_image.h"
#include "analyzers/options/slave_names.h"
#include "decoder/base/result.h"

namespace ecaudit::cli {

enum class ColumnKind : std::uint8_t {
  kSignal,
  kDriveState,    ///< of a status word
  kDriveCommand,  ///< of a control word
  kMeaning,       ///< of another object, in the words of the family's manual
  kRaw,           ///< all bytes of one slave and direction, where their meaning is not known
  kDatagram,      ///< all bytes of a datagram, where no place of a slave in it is known
};

/// What --signal, --states and --scaled ask for.
struct SignalChoice {
  /// Names or objects with * and ?, lower case; empty: all.
  std::vector<std::string> patterns;
  bool states = false;
  bool scaled = false;

  /// Reads the values of --signal, separated by commas.
  [[nodiscard]] static Result<std::vector<std::string>> ParsePatterns(const std::vector<std::string>& texts);
};

struct SignalColumn {
  ColumnKind kind = ColumnKind::kSignal;
  std::string slave;  ///< "S0", or "0x1001" where the position is not known
  std::string slave_name;
  std::optional<SlavePos> position;
  std::optional<StationAddress> station;
  device::PdoDirection direction = device::PdoDirection::kRx;
  std::uint16_t pdo = 0;
  std::uint16_t index = 0;
  std::uint8_t subindex = 0;
  std::uint16_t bits = 0;
  std::uint16_t repetition = 0;  ///< the same object once more in the same PDO
  std::string name;              ///< without slave; printable
  bool name_inferred = false;
  std::string variable;  ///< what the ENI file calls it; printable, empty: nothing
  mailbox::DataType type = mailbox::DataType::kUnknown;
  std::string unit;
  std::string scale;
  double divisor = 1;  ///< what values are divided by
  model::LayoutSource source = model::LayoutSource::kUnknown;
  std::string reason;  ///< why the bytes are raw
  std::string header;  ///< "S0.Status word", unique; set by Finish()
};

/// The columns that one part of a datagram fills.
struct PartColumns {
  static constexpr std::uint32_t kNone = ~std::uint32_t{0};
  struct Signal {
    std::uint32_t place = 0;  ///< number in ImagePart::places
    std::uint32_t column = kNone;
    std::uint32_t extra = kNone;  ///< state, command or meaning
  };
  std::vector<Signal> signals;
  std::uint32_t raw = kNone;

  [[nodiscard]] bool empty() const { return signals.empty() && raw == kNone; }
};

class SignalColumns {
 public:
  /// Further columns are left out with a warning: no bus has as many.
  static constexpr std::size_t kMaxColumns = 16'384;
  /// Parts that are remembered, more than any bus has at a time; beyond it each is looked up again.
  static constexpr std::size_t kMaxParts = 32'768;

  explicit SignalColumns(SignalChoice choice) : choice_(std::move(choice)) {}
  /// What columns call slaves, from here on.
  void SetNames(const SlaveNames& names) { names_ = names; }

  /// The columns of a part, added where they are new and Finish() was not called yet.
  [[nodiscard]] const PartColumns& Of(const model::ImagePart& part, const track::Network& network);
  /// The column of a datagram in which no data of a slave are known; kNone when not asked for.
  /// @param returned  the copy that came back; else the one sent
  [[nodiscard]] std::uint32_t OfDatagram(const track::LogicalAccess& access, bool returned, const std::string& reason);
  /// Forgets which part fills what, for the next pass.
  void NewPass() { parts_.clear(); }
  /// All columns are known: sorts and names them.
  void Finish();

  [[nodiscard]] std::span<const SignalColumn> columns() const { return columns_; }
  /// Where Finish() put the column that had this number before.
  [[nodiscard]] std::uint32_t PlaceOf(std::uint32_t column) const { return place_[column]; }
  [[nodiscard]] bool full() const { return full_; }
  /// Patterns of --signal that no column matched.
  [[nodiscard]] std::vector<std::string> unmatched() const;
  /// Names of signals that --signal passed over, a few of them, for the message when nothing is left.
  [[nodiscard]] const std::vector<std::string>& passed_over() const { return passed_over_; }

 private:
  [[nodiscard]] std::uint32_t Find(SignalColumn column);
  [[nodiscard]] bool Wants(const SignalColumn& column);

  SignalChoice choice_;
  SlaveNames names_;
  std::vector<bool> matched_ = std::vector<bool>(choice_.patterns.size());  ///< by pattern
  std::vector<SignalColumn> columns_;
  std::vector<std::uint32_t> place_;  ///< by number before Finish()
  std::unordered_map<std::string, std::uint32_t> by_key_;
  /// By ImagePart::serial. Parts that were made again leave theirs after.
  std::unordered_map<std::uint64_t, PartColumns> parts_;
  std::vector<std::string> passed_over_;
  bool finished_ = false;
  bool full_ = false;
};

/// Case-insensitive; * means any text, ? for one character. Both sides lower case.
[[nodiscard]] bool MatchesPattern(std::string_view pattern, std::string_view text);

}  // namespace ecaudit::cli
