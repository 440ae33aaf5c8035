/// Integers of 128 bit: sums that cannot overflow, and that are the same in whatever order they are made.
#pragma once

namespace ecaudit {

__extension__ using Unsigned128 = unsigned __int128;
__extension__ using Signed128 = __int128;

}  // namespace ecaudit
