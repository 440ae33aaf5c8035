#include "analyzers/wiring/event_bus.h"

#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace ecaudit {
namespace {

using ::testing::ElementsAre;
using ::testing::IsEmpty;

struct Rang {
  int number = 0;
};
struct Knocked {};

using Lines = std::vector<std::string>;

struct Listening {
  Listening(std::string with_name, Lines& to) : name(std::move(with_name)), lines(to) {}
  void On(const Rang& event) { lines.push_back(name + " rang " + std::to_string(event.number)); }
  void On(const Knocked&) { lines.push_back(name + " knocked"); }

  std::string name;
  Lines& lines;
};

TEST(EventBus, ByStageAndThenByRegistration) {
  Lines lines;
  Listening a("a", lines), b("b", lines), c("c", lines), d("d", lines);
  EventBus bus;
  bus.ListenTo<Rang>(Stage::kAfterModel, a);
  bus.ListenTo<Rang>(Stage::kBeforeModel, b);
  bus.ListenTo<Rang>(Stage::kModel, c);
  bus.ListenTo<Rang>(Stage::kBeforeModel, d);
  bus.Publish(Rang{7});
  EXPECT_THAT(lines, ElementsAre("b rang 7", "d rang 7", "c rang 7", "a rang 7"));
}

TEST(EventBus, OnlyThoseWhoListenToTheType) {
  Lines lines;
  Listening a("a", lines), b("b", lines);
  EventBus bus;
  bus.ListenTo<Rang, Knocked>(Stage::kModel, a);
  bus.ListenTo<Knocked>(Stage::kModel, b);
  bus.Publish(Rang{1});
  bus.Publish(Knocked{});
  EXPECT_THAT(lines, ElementsAre("a rang 1", "a knocked", "b knocked"));
}

TEST(EventBus, WhatNobodyHearsGoesNowhere) {
  struct Unheard {};
  EventBus bus;
  EXPECT_FALSE(bus.HasSubscribers<Unheard>());
  bus.Publish(Unheard{});
  EventSink nobody;
  nobody.Publish(Rang{1});
  Lines lines;
  Listening a("a", lines);
  bus.ListenTo<Rang>(Stage::kModel, a);
  EXPECT_TRUE(bus.HasSubscribers<Rang>());
  EXPECT_THAT(lines, IsEmpty());
}

/// Knocks whenever it rings.
struct Relaying {
  explicit Relaying(EventBus& to) : bus(to) {}
  void Ring(const Rang&) { bus.Publish(Knocked{}); }
  EventBus& bus;
};

TEST(EventBus, AnEventOfAnEventIsToldBeforeTheFirstGoesOn) {
  Lines lines;
  Listening last("last", lines);
  EventBus bus;
  Relaying relaying(bus);
  bus.Listen(Stage::kModel, relaying, &Relaying::Ring);
  bus.ListenTo<Rang>(Stage::kAfterModel, last);
  bus.ListenTo<Knocked>(Stage::kAfterModel, last);
  bus.Publish(Rang{3});
  EXPECT_THAT(lines, ElementsAre("last knocked", "last rang 3"));
}

struct Base {
  virtual ~Base() = default;
  virtual void On(const Rang&) = 0;
};
struct Derived final : Base {
  void On(const Rang& event) override { heard = event.number; }
  int heard = 0;
};

TEST(EventBus, AHandlerOfABaseIsTheOneThatOverridesIt) {
  Derived derived;
  EventBus bus;
  bus.Listen(Stage::kModel, static_cast<Base&>(derived), &Base::On);
  bus.Publish(Rang{9});
  EXPECT_EQ(derived.heard, 9);
}

TEST(EventBus, AWishMayBeMadeBeforeThereIsABus) {
  Lines lines;
  Listening a("a", lines);
  const auto wish = EventBus::Subscription::Of<Rang>(Stage::kModel, a, &Listening::On);
  EventBus first, second;
  second.Add(wish);
  first.Publish(Rang{1});
  second.Publish(Rang{2});
  EXPECT_THAT(lines, ElementsAre("a rang 2"));
}

struct Touched {
  MemoryRange bytes;
  [[nodiscard]] MemoryRange range() const { return bytes; }
};
struct Hand {
  void On(const Touched& event) { felt.push_back(event.bytes.first); }
  std::vector<EscAddress> felt;
};

TEST(EventBus, OfMemoryThoseHearWhoseBytesAreTouched) {
  Hand status, all;
  EventBus bus;
  bus.Listen(Stage::kModel, status, &Hand::On, MemoryRange::Of(0x0130, 2));
  bus.ListenTo<Touched>(Stage::kModel, all);
  for (const MemoryRange& bytes :
       {MemoryRange::Of(0x012F, 1), MemoryRange::Of(0x012E, 3), MemoryRange::Of(0x0131, 8), MemoryRange::Of(0x0132, 8),
        MemoryRange::Of(0x0130, 0), MemoryRange::Of(0x0000, 0xFFFF), MemoryRange::Of(0xFFFF, 2)}) {
    bus.Publish(Touched{bytes});
  }
  EXPECT_THAT(status.felt, ElementsAre(0x012E, 0x0131, 0x0130, 0x0000));
  EXPECT_EQ(all.felt.size(), 7U);
  EXPECT_EQ(MemoryRange::Of(0xFFFF, 2).last, 0xFFFF) << "there is nothing behind";
}

TEST(EventBus, OfMemoryWhoHearsIsTheSameHoweverManyRangesComeBetween) {
  constexpr std::size_t kRanges = 40;
  std::vector<Hand> hands(kRanges);
  EventBus bus;
  for (std::size_t i = 0; i < kRanges; ++i) {
    bus.Listen(Stage::kModel, hands[i], &Hand::On, MemoryRange::Of(static_cast<EscAddress>(16 * i), 16));
  }
  for (int round = 0; round < 3; ++round) {
    for (std::size_t i = 0; i < kRanges; ++i) bus.Publish(Touched{MemoryRange::Of(static_cast<EscAddress>(16 * i), 4)});
  }
  for (std::size_t i = 0; i < kRanges; ++i) {
    const auto own = static_cast<EscAddress>(16 * i);
    EXPECT_THAT(hands[i].felt, ElementsAre(own, own, own));
  }
  // Who comes later hears of a range that was published before.
  Hand late;
  bus.Listen(Stage::kModel, late, &Hand::On, MemoryRange::Of(0, 1));
  bus.Publish(Touched{MemoryRange::Of(0, 4)});
  EXPECT_THAT(late.felt, ElementsAre(0));
}

/// Touches the byte before those that it felt.
struct Groping {
  explicit Groping(EventBus& on) : bus(on) {}
  void On(const Touched& event) {
    felt.push_back(event.bytes.first);
    const EscAddress before = event.bytes.first;
    if (before > 0) bus.Publish(Touched{MemoryRange::Of(static_cast<EscAddress>(before - 1), 1)});
  }
  EventBus& bus;
  std::vector<EscAddress> felt;
};

TEST(EventBus, OfMemoryAListenerMayPublishTheSameTypeAgainAndAgain) {
  EventBus bus;
  Groping groping(bus);
  Hand after, elsewhere;
  bus.ListenTo<Touched>(Stage::kBeforeModel, groping);
  bus.ListenTo<Touched>(Stage::kModel, after);
  bus.Listen(Stage::kModel, elsewhere, &Hand::On, MemoryRange::Of(3, 1));
  constexpr EscAddress kDepth = 30;
  bus.Publish(Touched{MemoryRange::Of(kDepth, 1)});
  EXPECT_EQ(groping.felt.size(), kDepth + 1U);
  ASSERT_EQ(after.felt.size(), kDepth + 1U) << "each event reaches all of its listeners";
  for (EscAddress i = 0; i <= kDepth; ++i) EXPECT_EQ(after.felt[i], i);
  EXPECT_THAT(elsewhere.felt, ElementsAre(3));
}

}  // namespace
}  // namespace ecaudit
