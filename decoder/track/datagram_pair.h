/// in: BusTransaction.  out: one of its datagrams with both copies, and the access of one slave that it makes.
#pragma once

#include <cstddef>
#include <cstdint>

#include "decoder/bus/transaction.h"
#include "decoder/track/access.h"
#include "decoder/wire/command.h"
#include "decoder/wire/frame_view.h"

namespace ecaudit::track {

/// Valid as long as the transaction.
struct DatagramPair {
  DatagramPair(const bus::BusTransaction& whole, std::size_t n)
      : transaction(whole),
        ordinal(n),
        any(whole.any()[n]),
        has_sent(whole.sent != nullptr && n < whole.sent->size()),
        has_returned(whole.returned != nullptr),
        sent_(has_sent ? (*whole.sent)[n] : any) {}

  const bus::BusTransaction& transaction;
  std::size_t ordinal;
  wire::DatagramView any;  ///< returned copy if captured, else the outbound one
  bool has_sent;
  bool has_returned;

  [[nodiscard]] wire::Command command() const { return any.command(); }
  [[nodiscard]] EscAddress address() const { return any.ado(); }
  /// The outbound copy; where the capture has none, the other one.
  [[nodiscard]] const wire::DatagramView& sent() const { return sent_; }
  [[nodiscard]] bool assumed() const { return transaction.assumed; }
  [[nodiscard]] std::uint16_t wkc() const { return has_returned ? any.wkc() : std::uint16_t{0}; }
  /// What the master wrote. Slaves leave the data of pure writes alone, so the returned copy will do.
  [[nodiscard]] ByteSpan written() const {
    if (!wire::Writes(command())) return {};
    if (has_sent) return sent().data();
    return wire::Reads(command()) ? ByteSpan{} : any.data();
  }
  [[nodiscard]] ByteSpan read() const { return wire::Reads(command()) && has_returned ? any.data() : ByteSpan{}; }
  [[nodiscard]] bool CoversByte(EscAddress byte) const { return track::CoversByte(address(), any.length(), byte); }

  [[nodiscard]] SlaveAccess Access(SlaveId slave, Acceptance acceptance) const {
    return {
        .slave = slave,
        .sent = transaction.sent_ref(),
        .returned = transaction.returned_ref(),
        .command = command(),
        .datagram = any.ordinal(),
        .address = address(),
        .written = written(),
        .read = acceptance == Acceptance::kAccepted ? read() : ByteSpan{},
        .acceptance = acceptance,
        .broadcast = wire::IsBroadcast(command()),
    };
  }

 private:
  wire::DatagramView sent_;
};

}  // namespace ecaudit::track
