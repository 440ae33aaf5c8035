/// What all parts of Pairing work on: the senders, the window of frames, the usual round trip, the counts.
#pragma once

#include <array>
#include <cstdint>

#include "decoder/bus/direction.h"
#include "decoder/bus/pairing_statistics.h"
#include "decoder/bus/round_trip.h"
#include "decoder/bus/sending_rhythm.h"
#include "decoder/bus/sent_frames.h"
#include "decoder/bus/transaction.h"

namespace ecaudit::bus {

/// What the capture holds of the returns of one sender: only ever more.
enum class Returns : std::uint8_t {
  kNotCaptured,  ///< none are captured: what it sends is taken as done
  kNoneYet,
  kSome,   ///< a frame returned to it
  kPairs,  ///< both copies of one of its frames were seen
};

struct Sender {
  std::uint64_t mac = 0;
  Returns returns = Returns::kNoneYet;
  bool own_return_port = false;  ///< outbound and returned copies were captured on two interfaces
  std::uint64_t newest = 0;      ///< one more than the sequence number of its last frame; 0: none
  SendingRhythm rhythm;

  [[nodiscard]] bool answered() const noexcept { return returns >= Returns::kSome; }
  void Saw(Returns more) noexcept {
    if (returns < more) returns = more;
  }
};

/// Whose a frame is, by its address.
struct Owner {
  static constexpr std::uint8_t kAnybody = 0xFF;
  std::uint8_t sender = kAnybody;
  [[nodiscard]] bool MayBe(std::uint8_t other) const noexcept { return sender == kAnybody || sender == other; }
};

class Senders {
 public:
  /// Number of the sender of this frame; more than any bus has share the last place.
  [[nodiscard]] std::uint8_t IndexOf(const wire::FrameView& frame, const DirectionLearner& directions) noexcept {
    const std::uint64_t mac = frame.sender();
    for (std::uint8_t i = 0; i < count_; ++i) {
      if (all_[i].mac == mac) return i;
    }
    if (count_ == all_.size()) return static_cast<std::uint8_t>(all_.size() - 1);
    all_[count_].mac = mac;
    if (directions.Unanswered(frame) && !directions.IsOnePort(frame)) all_[count_].returns = Returns::kNotCaptured;
    return count_++;
  }
  /// Whose frames may have returned with this address: a frame keeps its own. Where the address is none that sends, a
  /// switch or a card has written another one, and it may belong to any sender.
  [[nodiscard]] Owner OwnerOf(const wire::FrameView& returned) const noexcept {
    const std::uint64_t mac = returned.sender();
    for (std::uint8_t i = 0; i < count_; ++i) {
      if (all_[i].mac == mac && all_[i].newest > 0) return {i};
    }
    return {};
  }
  [[nodiscard]] Sender& operator[](std::uint8_t number) noexcept { return all_[number]; }
  [[nodiscard]] const Sender& operator[](std::uint8_t number) const noexcept { return all_[number]; }
  [[nodiscard]] std::uint8_t size() const noexcept { return count_; }
  [[nodiscard]] auto begin() noexcept { return all_.begin(); }
  [[nodiscard]] auto end() noexcept { return all_.end(); }

 private:
  std::array<Sender, 2 * DirectionLearner::kMaxMasters> all_{};
  std::uint8_t count_ = 0;
};

struct PairingContext {
  PairingContext(const DirectionLearner& learned, BusSink& receiver) : directions(learned), sink(receiver) {}

  const DirectionLearner& directions;
  BusSink& sink;
  SentFrames sent;
  Senders senders;
  RoundTrip trip;
  PairingStatistics statistics;
  bool any_cut = false;        ///< by the snap length
  bool unreadable = false;     ///< a packet since the last pair that may have been any frame
  bool returns_early = false;  ///< a return stood before its outbound copy

  [[nodiscard]] Sender& SenderOfSent(const SentFrame& frame) noexcept { return senders[frame.sender]; }
  [[nodiscard]] IndexSequence& IndicesOf(const SentFrame& frame) noexcept {
    return senders[frame.sender].rhythm.indices;
  }
  /// It is unknown what a packet was; it may have been the return of any frame in flight.
  void DoubtAll(Undecided reason) noexcept {
    sent.EachOpen(sent.end(), [&](SentFrame& frame) { frame.Doubt(reason); });
  }
};

}  // namespace ecaudit::bus
