/// What HTML reports draw, as JSON: the part of the page's data that the JSON report does not have.
#pragma once

#include "analyzers/result/analysis_result.h"
#include "analyzers/result/timeline.h"

namespace ecaudit::report {

class JsonObject;

/// {"frames", "lost", "cycle_us", "slaves": [{"slave", "signals", "mailbox", "sdos", "phase_us", "difference_ns",
/// ...}], "signals_left_out"}. Times are seconds from the first packet. A series is {"start_s", "width_s", "at",
/// "least", "most", "count"}: of the buckets that hold something, the numbers (absent when there are no gaps), the
/// least and the most values (the latter absent when equal), or for counting series the counts. A field of bits
/// ("word") also has "any" and "all": the bits that are set in at least one value of the bucket, and in each (absent
/// when equal). "frames" has the first frame number of each bucket.
void PutTimeline(JsonObject& out, const AnalysisResult& result, const Timeline& timeline);

}  // namespace ecaudit::report
