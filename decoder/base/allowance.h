/// What all slaves together may keep of one kind. Each has a limit of its own that none reaches in practice; a capture
/// with thousands of slaves that all reach it would exhaust memory nevertheless.
#pragma once

#include <cstddef>

namespace ecaudit {

class Allowance {
 public:
  explicit Allowance(std::size_t most) : left_(most) {}
  Allowance(const Allowance&) = delete;
  Allowance& operator=(const Allowance&) = delete;

  /// @return false, and nothing is taken, where less than `count` is left
  bool Take(std::size_t count) {
    if (count > left_) return false;
    left_ -= count;
    return true;
  }
  void GiveBack(std::size_t count) { left_ += count; }

 private:
  std::size_t left_;
};

/// The same where there may be no common limit.
/// @param all null: nothing is limited
inline bool TakeFrom(Allowance* all, std::size_t count) {
  return all == nullptr || all->Take(count);
}

}  // namespace ecaudit
