/// What all slaves together may keep of one kind. Each has a limit of its own that none reaches in practice; a capture
/// with thousands of slaves that all reach it would exhaust memory nevertheless.
#pragma once

#include <cstddef>

namespace ecaudit {

class Allowance {
 public:
  /// @param beyond  what more may be taken from, where these are used up; null: nothing, else must outlive this. So
  /// each
  ///                slave has something that the others cannot take from it
  explicit Allowance(std::size_t most, Allowance* beyond = nullptr) : left_(most), beyond_(beyond) {}
  Allowance(const Allowance&) = delete;
  Allowance& operator=(const Allowance&) = delete;

  /// @return false, and nothing is taken, where less than `count` is left
  bool Take(std::size_t count) {
    const std::size_t own = count < left_ ? count : left_;
    if (own < count) {
      if (beyond_ == nullptr || !beyond_->Take(count - own)) return false;
      borrowed_ += count - own;
    }
    left_ -= own;
    return true;
  }
  void GiveBack(std::size_t count) {
    const std::size_t back = count < borrowed_ ? count : borrowed_;
    if (back > 0) beyond_->GiveBack(back);
    borrowed_ -= back;
    left_ += count - back;
  }

 private:
  std::size_t left_;
  std::size_t borrowed_ = 0;
  Allowance* beyond_;
};

/// The same where there may be no common limit.
/// @param all null: nothing is limited
inline bool TakeFrom(Allowance* all, std::size_t count) {
  return all == nullptr || all->Take(count);
}

}  // namespace ecaudit
