/// in: FMMUs and sync managers of a slave, or what the ENI has of it; its PDOs.  out: where its process data of one
/// direction, and each signal of them, lie in one kind of datagram.
///
/// Source: esc-reference 6, 7; ETG.2100 (process image).
#pragma once

#include <cstdint>
#include <vector>

#include "analyzers/model/image_part.h"
#include "analyzers/model/logical_kinds.h"
#include "analyzers/model/split_signals.h"
#include "decoder/device/eni_reader.h"
#include "decoder/esc/fmmu.h"
#include "decoder/esc/sync_manager.h"
#include "decoder/track/slave_state.h"

namespace ecaudit::model {

/// Signals of one part that do not lie in one piece, and the places that need no other datagram.
struct SplitPlaces {
  SplitSignals signals;
  std::vector<ImagePart::Place> alone;
};

/// The active FMMUs of one direction that map process data; none where no FMMU of the slave reaches the datagram.
[[nodiscard]] std::vector<esc::Fmmu> DataFmmus(const track::KnownFmmus& known, device::PdoDirection direction,
                                               const LogicalKind& kind);

// Each function sets runs, bits, places and reason of a part whose slave, model, direction and layout are set. A part
// without runs has nothing in the datagram.

/// By FMMUs, bit by bit.
/// @param fmmus as DataFmmus() gives them for the direction
[[nodiscard]] SplitPlaces PlaceByFmmus(ImagePart& part, const track::KnownFmmus& known,
                                       const std::vector<esc::Fmmu>& fmmus, const LogicalKind& kind);
/// As the ENI has it.
/// @param offset bytes of the process image before the datagram
void PlaceByEni(ImagePart& part, const device::EniSlave& eni, std::uint32_t offset, std::uint16_t length);
/// In the buffer of sync manager `n`, which a datagram reads or writes without FMMU.
void PlaceInBuffer(ImagePart& part, std::size_t n, const esc::SyncManager& manager, EscAddress address,
                   std::uint16_t length);

}  // namespace ecaudit::model
