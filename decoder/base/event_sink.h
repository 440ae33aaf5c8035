/// Where a stage puts what it has found out: one way for every type of event.
///
/// An event is a plain struct, declared once, where it is made. Publish() calls, one after the other, those who listen
/// to its type; who they are and in which order is the business of analyzers/wiring/event_bus.h. The spans and
/// references in an event are valid during the call.
#pragma once

#include <array>
#include <concepts>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <vector>

#include "decoder/base/ids.h"

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

/// Part of the memory of an ESC, both ends included.
struct MemoryRange {
  EscAddress first = 0;
  EscAddress last = 0xFFFF;

  /// @param length of none, as of one, byte the first counts
  [[nodiscard]] static constexpr MemoryRange Of(EscAddress first, std::size_t length) {
    const std::size_t last = first + (length > 0 ? length - 1 : 0);
    return {first, last < 0xFFFF ? static_cast<EscAddress>(last) : EscAddress{0xFFFF}};
  }
  [[nodiscard]] constexpr bool Meets(const MemoryRange& other) const {
    return first <= other.last && other.first <= last;
  }
  bool operator==(const MemoryRange&) const = default;
};

/// An event about some bytes of a slave: who listens may name those that matter, and learns of nothing else.
template <class Event>
concept OfMemory = requires(const Event& event) {
  { event.range() } -> std::same_as<MemoryRange>;
};

/// By itself it has no listeners: what is published goes nowhere. EventBus has them.
class EventSink {
 public:
  EventSink() = default;
  EventSink(const EventSink&) = delete;
  EventSink& operator=(const EventSink&) = delete;

  /// Allocates nothing; an event without subscriber costs one load. Listeners may publish further events.
  template <class Event>
  void Publish(const Event& event) const {
    const Subscribers& subscribers = subscribers_.data()[event_types::kNumber<Event>];  // Next() keeps below kMost
    if constexpr (OfMemory<Event>) {
      if (subscribers.size != 0) PublishOfMemory(subscribers, event.range(), &event);
    } else {
      const Listener* const end = subscribers.first + subscribers.size;
      for (const Listener* listener = subscribers.first; listener != end; ++listener) listener->call(*listener, &event);
    }
  }

  /// Whether it is worth to make such an event at all.
  template <class Event>
  [[nodiscard]] bool HasSubscribers() const {
    return subscribers_.data()[event_types::kNumber<Event>].size != 0;
  }

 protected:
  /// A member function of an object, the types of both forgotten.
  struct Listener {
    static constexpr std::size_t kHandlerBytes = 2 * sizeof(void*);
    void (*call)(const Listener& self, const void* event) = nullptr;
    void* object = nullptr;
    std::array<std::byte, kHandlerBytes> handler{};
    MemoryRange range;  ///< of events OfMemory
  };
  /// Those of a type OfMemory whose range meets that of an event: masters access the same few registers in every cycle.
  struct Selection {
    MemoryRange range{1, 0};                 ///< none that an event has
    std::uint32_t calling = 0;               ///< events that are being handed to them
    std::vector<const Listener*> listeners;  ///< with room for all
  };
  struct Selections {
    std::array<Selection, 8> kept;
    std::size_t next = 0;
    Selection of_all;
  };
  struct Subscribers {
    const Listener* first = nullptr;
    std::size_t size = 0;
    Selections* selections = nullptr;  ///< of a type OfMemory
  };
  std::array<Subscribers, event_types::kMost> subscribers_{};

 private:
  static void PublishOfMemory(const Subscribers& subscribers, const MemoryRange& range, const void* event) {
    Selection& selection = Select(subscribers, range);
    const bool chosen = selection.range == range;
    ++selection.calling;
    for (const Listener* listener : selection.listeners) {
      if (chosen || listener->range.Meets(range)) listener->call(*listener, event);
    }
    --selection.calling;
  }
  static Selection& Select(const Subscribers& subscribers, const MemoryRange& range) {
    for (Selection& selection : subscribers.selections->kept) {
      if (selection.range == range) return selection;
    }
    return Choose(subscribers, range);
  }
  [[gnu::noinline]] static Selection& Choose(const Subscribers& subscribers, const MemoryRange& range) {
    Selections& all = *subscribers.selections;
    Selection& selection = all.kept[all.next];
    // Its listeners are being called: a listener has published events of the same type.
    if (selection.calling != 0) return all.of_all;
    all.next = (all.next + 1) % all.kept.size();
    selection.range = range;
    selection.listeners.clear();
    for (const Listener* listener : all.of_all.listeners) {
      if (listener->range.Meets(range)) selection.listeners.push_back(listener);
    }
    return selection;
  }
};

}  // namespace ecaudit
