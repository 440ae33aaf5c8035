/// in: SDO transfers of PDO objects (1C12h, 1C13h, 16xxh, 1Axxh), AL requests.  out: what the master wrote to them for
/// each request, and what the slave answered: also what it refused, which the model of the slave does not keep.
///
/// keeps: the newest configurations of a slave, and kMaxEntries values of all slaves.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <map>
#include <optional>

#include "analyzers/model/bus_model.h"
#include "analyzers/wiring/event_bus.h"
#include "decoder/device/object_dictionary.h"
#include "decoder/mailbox/events.h"
#include "decoder/track/events.h"

namespace ecaudit {

class MappingHistory {
 public:
  static constexpr std::size_t kMaxConfigurations = 4;  ///< of a slave; the oldest goes first
  static constexpr std::size_t kMaxEntries = 16'384;

  /// One subindex of a PDO object.
  struct Entry {
    bool written = false;
    std::uint32_t value = 0;  ///< as the master wrote it
    mailbox::SdoOutcome outcome = mailbox::SdoOutcome::kCompleted;
    std::uint32_t abort_code = 0;
    FrameNo frame = 0;
    std::optional<std::uint32_t> read;  ///< by an upload after that; of an aborted write also what was there before

    /// The slave accepted the value, and did not show another one.
    [[nodiscard]] bool accepted() const {
      return written && outcome == mailbox::SdoOutcome::kCompleted && (!read || *read == value);
    }
    [[nodiscard]] bool aborted() const { return written && outcome == mailbox::SdoOutcome::kAborted; }
  };
  using List = std::map<std::uint8_t, Entry>;  ///< by subindex; 0: the number of entries
  struct Manager {
    std::uint16_t bytes = 0;
    FrameNo since = 0;
  };
  /// What was written up to one request.
  struct Configuration {
    FrameNo first = 0;
    bool closed = false;                             ///< a request followed
    std::map<std::uint16_t, List> lists;             ///< by index
    std::array<std::optional<Manager>, 2> managers;  ///< SM2 and SM3 at the request
  };

  /// @param model  must outlive this
  MappingHistory(const model::BusModel& model, EventBus& bus);

  void On(const mailbox::SdoTransfer& transfer);
  void On(const track::AlRequest& request);
  void On(const track::RunBegan& began);

  /// The newest that had begun at this frame; null: none.
  [[nodiscard]] const Configuration* Of(SlaveId slave, FrameNo frame) const;
  /// At the request after it; at the end of the capture where there is none.
  [[nodiscard]] std::optional<Manager> ManagerOf(SlaveId slave, const Configuration& configuration,
                                                 device::PdoDirection direction) const;

 private:
  struct Slave {
    std::deque<Configuration> configurations;
    bool forgotten = false;  ///< the next configuration does not go on with what was written before
  };
  Configuration* Open(SlaveId slave, FrameNo frame);
  [[nodiscard]] std::optional<Manager> ManagerNow(SlaveId slave, std::size_t number) const;

  const model::BusModel& model_;
  std::deque<Slave> slaves_;
  std::size_t entries_ = 0;
};

}  // namespace ecaudit
