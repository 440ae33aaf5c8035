/// in: which slave's sync managers or FMMUs may have changed.  out: versions, and the FMMUs that a slave is known to
/// have.
///
/// keeps: the FMMUs of each slave, decoded once after each change and only on request.
#pragma once

#include <cstdint>
#include <vector>

#include "decoder/track/slave_state.h"

namespace ecaudit::track {

class MappingCache {
 public:
  /// Changes whenever any sync manager or FMMU may have changed, or a slave was added.
  [[nodiscard]] std::uint64_t version() const { return version_; }
  /// The version that the last change of this slave's sync managers or FMMUs made.
  [[nodiscard]] std::uint64_t changed(SlaveId id) const { return mappings_[id].changed; }
  [[nodiscard]] std::size_t size() const { return mappings_.size(); }
  /// The slave's FMMUs and sync managers, at least inferred.
  [[nodiscard]] const KnownFmmus& fmmus(SlaveId id, const SlaveState& state) const {
    const Mapping& mapping = mappings_[id];
    return mapping.decoded == mapping.changed ? mapping.fmmus : Decode(id, state);
  }

  /// One more slave, after the others.
  void Add();
  /// @param slave kNoSlave: what a broadcast leaves in slaves that are met later
  void Changed(SlaveId slave);

 private:
  struct Mapping {
    std::uint64_t changed = 0;  ///< version of the last change
    std::uint64_t decoded = 0;  ///< the one that `fmmus` belongs to
    KnownFmmus fmmus;
  };

  const KnownFmmus& Decode(SlaveId id, const SlaveState& state) const;

  std::uint64_t version_ = 0;
  mutable std::vector<Mapping> mappings_;  ///< decoded when asked for
};

}  // namespace ecaudit::track
