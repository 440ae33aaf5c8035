/// The sections of the JSON report, each in a file of its own. Each function fills the object of its section; those
/// with a key put the whole member, which may be null.
#pragma once

#include <string_view>

#include "analyzers/result/analysis_result.h"

namespace ecaudit::report {

class AlikeSteps;
class JsonObject;

// slave_json.cpp
void PutSlave(JsonObject& out, const AnalysisResult& result, const SlaveSummary& slave, const AlikeSteps& alike);
void PutEventBit(JsonObject& out, const EventBitSummary& bit);

// process_data_json.cpp
void PutSyncManager(JsonObject& out, const SyncManagerSummary& manager);
void PutFmmu(JsonObject& out, const FmmuSummary& fmmu);
void PutPdos(JsonObject& out, const PdoSummary& rx, const PdoSummary& tx);

// latch_json.cpp
void PutLatch(JsonObject& out, const LatchSummary& latch);

// sync_json.cpp
void PutCycle(JsonObject& out, const CycleSummary& cycle);
/// Null when no time was read from the reference clock.
void PutBusDc(JsonObject& out, std::string_view key, const AnalysisResult& result);
void PutDc(JsonObject& out, const AnalysisResult& result, const DcSummary& dc);

// topology_json.cpp
/// Null when DL status of no slave was read.
void PutTopology(JsonObject& out, std::string_view key, const AnalysisResult& result);

// drive_json.cpp
void PutDrive(JsonObject& out, const AnalysisResult& result, const DriveSummary& drive);

// progress_json.cpp
void PutLadder(JsonObject& out, std::string_view key, const AnalysisResult& result, const Ladder& ladder);

// startup_json.cpp
/// Null when the capture shows nothing of it. Steps that stand in `alike` are reported there.
void PutStartup(JsonObject& out, std::string_view key, const AnalysisResult& result, const StartupSummary& startup,
                const AlikeSteps* alike = nullptr);
/// What was done, and how it ended; not when, nor what was read there later.
void PutStepWhat(JsonObject& out, const StartupStep& step);
void PutAlikeSteps(JsonObject& out, std::string_view key, const AlikeSteps& alike);

}  // namespace ecaudit::report
