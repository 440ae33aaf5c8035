/// in: facts, each known to hold or not.  out: the verdict of the first row of a table that they fit.
///
/// Where evidence is weighed, all of it stands in one table: a row names the facts that it needs and those that speak
/// against it. Rows are read from the top; the last one fits whatever is known.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <initializer_list>

namespace ecaudit {

/// A set of facts. @tparam Fact an enum whose values count from 0, at most 32
template <class Fact>
class Facts {
 public:
  constexpr Facts(std::initializer_list<Fact> facts) {
    for (const Fact fact : facts) Set(fact, true);
  }
  constexpr void Set(Fact fact, bool holds) { bits_ |= std::uint32_t{holds} << static_cast<unsigned>(fact); }
  [[nodiscard]] constexpr bool Has(Facts all) const { return (bits_ & all.bits_) == all.bits_; }
  [[nodiscard]] constexpr bool HasAny(Facts some) const { return (bits_ & some.bits_) != 0; }

 private:
  std::uint32_t bits_ = 0;
};

template <class Fact, class Verdict>
struct EvidenceRow {
  Facts<Fact> all;   ///< what it needs
  Facts<Fact> none;  ///< what speaks against it
  Verdict verdict;

  [[nodiscard]] constexpr bool Fits(Facts<Fact> facts) const { return facts.Has(all) && !facts.HasAny(none); }
};

/// Number of the row that decides. @param table its last row needs nothing, and nothing speaks against it
template <class Fact, class Verdict, std::size_t Rows>
[[nodiscard]] constexpr std::size_t RowFor(const std::array<EvidenceRow<Fact, Verdict>, Rows>& table,
                                           Facts<Fact> facts) {
  std::size_t row = 0;
  while (row + 1 < Rows && !table[row].Fits(facts)) ++row;
  return row;
}

template <class Fact, class Verdict, std::size_t Rows>
[[nodiscard]] constexpr Verdict Decide(const std::array<EvidenceRow<Fact, Verdict>, Rows>& table, Facts<Fact> facts) {
  return table[RowFor(table, facts)].verdict;
}

}  // namespace ecaudit
