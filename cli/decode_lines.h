/// Where a frame stands in the text that `decode` writes: the line that CI servers are told of.
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "analyzers/result/finding.h"

namespace ecaudit::cli {

/// For each finding the line of its first frame in `ecaudit decode` of the whole capture, from 1; 0 where it has none,
/// or where the capture cannot be read a second time. Reads the capture up to the last of these frames.
/// @param paths  one capture, or the files of one ring buffer
[[nodiscard]] std::vector<std::uint64_t> DecodeLines(std::span<const std::string> paths,
                                                     std::span<const Finding> findings);

}  // namespace ecaudit::cli
