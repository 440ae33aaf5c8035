/// What a slice or an annotated copy writes beside the packets: each finding on its frame, and a word on every frame
/// that belongs to it. Texts name the frames of the capture that was read, since a copy numbers its packets again.
#pragma once

#include <map>
#include <string>
#include <vector>

#include "analyzers/result/analysis_result.h"
#include "decoder/base/result.h"

namespace ecaudit::cli {

/// Comments by frame number; each list in the order of the findings.
using FrameComments = std::map<FrameNo, std::vector<std::string>>;

/// "frame 760: f1 error al-refused, slave 0 (0x1001): title", then the message, the cause, repetitions and the manual.
/// Its last repetition and its related frames get one line that points there. Printable, lines end with "\n" inside.
[[nodiscard]] FrameComments CommentsOf(const AnalysisResult& result);

/// The findings that `names` ask for: ids as in reports ("f2"), or rules ("al-refused": all findings of it).
/// @return their places in result.findings, ascending; or what is wrong with a name
[[nodiscard]] Result<std::vector<std::size_t>> FindingsNamed(const AnalysisResult& result,
                                                             const std::vector<std::string>& names);

/// All frames that a finding rests on, ascending: its own, the last repetition, related ones, and those of its causes.
[[nodiscard]] std::vector<FrameNo> EvidenceFrames(const AnalysisResult& result, std::size_t finding);

/// The findings that cite no frame (of the whole file), one line each; empty when there are none.
[[nodiscard]] std::string FindingsWithoutFrame(const AnalysisResult& result);

}  // namespace ecaudit::cli
