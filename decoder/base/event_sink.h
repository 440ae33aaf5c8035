/// Where a stage puts what it has found out: one way for every type of event.
///
/// An event is a plain struct, declared once, where it is made. Publish() calls, one after the other, those who listen
/// to its type; who they are and in which order is the business of analyzers/wiring/event_bus.h. The spans and
/// references in an event are valid during the call.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <cstdlib>

namespace ecaudit {

namespace event_types {

/// Types of events that a program may have; plenty, and checked when it starts.
inline constexpr std::size_t kMost = 256;

/// @return a number that no other type of event has
inline std::uint16_t Next() {
  static std::uint16_t next = 0;
  if (next == kMost) std::abort();
  return next++;
}

/// Numbered before main(), in any order.
template <class Event>
inline const std::uint16_t kNumber = Next();

}  // namespace event_types

/// By itself it has no listeners: what is published goes nowhere. EventBus has them.
class EventSink {
 public:
  EventSink() = default;
  EventSink(const EventSink&) = delete;
  EventSink& operator=(const EventSink&) = delete;

  /// Allocates nothing; an event that nobody hears costs a load. Listeners may publish further events.
  template <class Event>
  void Publish(const Event& event) const {
    const Heard& heard = heard_[event_types::kNumber<Event>];
    for (std::size_t i = 0; i < heard.size; ++i) heard.first[i].call(heard.first[i], &event);
  }

  /// Whether it is worth to make such an event at all.
  template <class Event>
  [[nodiscard]] bool IsHeard() const {
    return heard_[event_types::kNumber<Event>].size != 0;
  }

 protected:
  /// A member function of an object, the types of both forgotten.
  struct Listener {
    static constexpr std::size_t kHandlerBytes = 2 * sizeof(void*);
    void (*call)(const Listener& self, const void* event) = nullptr;
    void* object = nullptr;
    std::array<std::byte, kHandlerBytes> handler{};
  };
  struct Heard {
    const Listener* first = nullptr;
    std::size_t size = 0;
  };
  std::array<Heard, event_types::kMost> heard_{};
};

}  // namespace ecaudit
