/// Who receives which event, and in which order.
///
/// Stages of one event, and what they mean:
///   kBeforeModel  what happened, against what was known before: rules compare, histories note the change
///   kModel        the models learn from it, and may publish what they conclude; each such event runs through its own
///                 stages at once, before this one goes on
///   kAfterModel   what is known now: for code that needs a slave as the event left it
/// Within a stage: in the order of registration, which is that of construction (models, collectors, rules by id).
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <cstring>
#include <memory>
#include <vector>

#include "decoder/base/event_sink.h"

namespace ecaudit {

enum class Stage : std::uint8_t { kBeforeModel, kModel, kAfterModel };

class EventBus : public EventSink {
 public:
  /// A subscription to one type of event, before or without a bus.
  class Subscription {
   public:
    template <class Event, class T>
    [[nodiscard]] static Subscription Of(Stage stage, T& listener, void (T::*handler)(const Event&),
                                         MemoryRange range = {}) {
      static_assert(sizeof handler <= Listener::kHandlerBytes);
      Subscription wish;
      wish.type_ = event_types::kNumber<Event>;
      wish.of_memory_ = OfMemory<Event>;
      wish.stage_ = stage;
      wish.listener_.object = &listener;
      wish.listener_.range = range;
      std::memcpy(wish.listener_.handler.data(), &handler, sizeof handler);
      wish.listener_.call = [](const Listener& self, const void* event) {
        void (T::*member)(const Event&) = nullptr;
        std::memcpy(&member, self.handler.data(), sizeof member);
        (static_cast<T*>(self.object)->*member)(*static_cast<const Event*>(event));
      };
      // Nearly every handler is called On. By its name it is called at once, or is part of the call.
      if constexpr (requires { static_cast<void (T::*)(const Event&)>(&T::On); }) {
        if (handler == static_cast<void (T::*)(const Event&)>(&T::On)) {
          wish.listener_.call = [](const Listener& self, const void* event) {
            static_cast<T*>(self.object)->On(*static_cast<const Event*>(event));
          };
        }
      }
      return wish;
    }

   private:
    friend class EventBus;
    std::uint16_t type_ = 0;
    Stage stage_ = Stage::kBeforeModel;
    bool of_memory_ = false;
    Listener listener_;
  };

  /// Not to be called while an event is published; the listener must live as long as events are.
  void Add(const Subscription& wish) {
    if (audiences_.size() <= wish.type_) audiences_.resize(std::size_t{wish.type_} + 1);
    Audience& audience = audiences_[wish.type_];
    const auto stage = static_cast<std::ptrdiff_t>(wish.stage_);
    const auto at = static_cast<std::ptrdiff_t>(audience.ends[static_cast<std::size_t>(stage)]);
    audience.listeners.insert(audience.listeners.begin() + at, wish.listener_);
    std::for_each(audience.ends.begin() + stage, audience.ends.end(), [](std::size_t& end) { ++end; });
    if (wish.of_memory_) {
      audience.selections = std::make_unique<Selections>();
      for (Selection& selection : audience.selections->kept) selection.listeners.reserve(audience.listeners.size());
      for (const Listener& listener : audience.listeners) {
        audience.selections->of_all.listeners.push_back(&listener);
      }
    }
    subscribers_[wish.type_] = {audience.listeners.data(), audience.listeners.size(), audience.selections.get()};
  }

  /// @param handler  called with every event of this type; where it is overloaded: Listen<Event>(...)
  /// @param range  of events OfMemory, those that touch it
  template <class Event, class T>
  void Listen(Stage stage, T& listener, void (T::*handler)(const Event&), MemoryRange range = {}) {
    Add(Subscription::Of(stage, listener, handler, range));
  }

  /// Listen() for several types whose handlers are all called On.
  template <class... Events, class T>
  void ListenTo(Stage stage, T& listener) {
    (Listen<Events>(stage, listener, &T::On), ...);
  }

 private:
  /// Those who receive one type, by stage.
  struct Audience {
    std::vector<Listener> listeners;
    std::array<std::size_t, 3> ends{};  ///< after the last listener of each stage
    std::unique_ptr<Selections> selections;
  };

  std::vector<Audience> audiences_;  ///< by event_types::kNumber
};

}  // namespace ecaudit
