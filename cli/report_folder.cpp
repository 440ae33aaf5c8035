#include "cli/report_folder.h"

#include <algorithm>
#include <cerrno>
#include <chrono>
#include <filesystem>
#include <string_view>
#include <thread>
#include <utility>
#include <vector>

#include "cli/json_file.h"
#include "cli/report/digest_json.h"
#include "cli/report/fingerprint.h"
#include "cli/report/layout.h"
#include "cli/version.h"
#include "decoder/base/system/files.h"
#include "decoder/base/text.h"

namespace ecaudit::cli {
namespace {

namespace fs = std::filesystem;

/// File names may have 255 bytes; the rest is for the hash, the ending and the temporary name.
constexpr std::size_t kLongestName = 200;
/// ".XXXXXX" after the name of a file that is being written.
constexpr std::size_t kTemporaryEnding = 7;

}  // namespace

std::string ReportName(const std::string& capture) {
  std::string name = fs::path(capture).filename().string().substr(0, kLongestName);
  std::ranges::replace_if(
      name, [](char c) { return static_cast<unsigned char>(c) < 0x20 || c == 0x7F; }, '_');
  return name + "-" + Hex(report::StableHash(capture), 16).substr(2, 12) + ".json";
}

std::optional<Error> MakeReportFolder(const std::string& folder) {
  if (system::MakeFolders(folder)) return std::nullopt;
  const std::string why = system::IsFile(folder) ? "there is a file of that name" : system::ReasonText(errno);
  return Error{"cannot make the folder " + folder + ": " + why};
}

void RemoveUnfinished(const std::string& folder, std::span<const std::string> report_names) {
  std::vector<std::string_view> names(report_names.begin(), report_names.end());
  std::ranges::sort(names);
  for (const std::string& name : system::NamesIn(folder).value_or(std::vector<std::string>())) {
    if (name.size() <= kTemporaryEnding || name[name.size() - kTemporaryEnding] != '.') continue;
    const std::string_view whole = std::string_view(name).substr(0, name.size() - kTemporaryEnding);
    if (std::ranges::binary_search(names, whole)) system::Remove((fs::path(folder) / name).string());
  }
}

FolderLock::FolderLock(const std::string& folder) : hold_(folder) {
  // The workers of a batch that was killed a moment ago may hold it still.
  constexpr int kTries = 5;
  constexpr auto kPause = std::chrono::milliseconds(20);
  // Without file locks a batch cannot know that it is alone.
  for (int i = 0; i < kTries && !alone_; ++i) {
    if (i > 0) std::this_thread::sleep_for(kPause);
    const system::FolderHold::Outcome outcome = hold_.TryAlone();
    alone_ = outcome == system::FolderHold::Outcome::kAlone;
    if (outcome == system::FolderHold::Outcome::kUnknown) return;
  }
}

void FolderLock::Share() {
  alone_ = false;
  // Who is alone there is so for a moment only.
  hold_.Share();
}

Result<report::CaptureDigest> ReadOwnReport(const std::string& path) {
  const Result<JsonDocument> document = ReadJsonFile(path, kLargestReport);
  if (!document) return document.error();
  Result<report::ReportDigest> report = report::ReadReportDigest(document->root());
  if (!report) return report.error();
  if (report->captures.size() != 1) return Error{"it does not hold exactly one capture"};
  return std::move(report->captures.front());
}

std::optional<report::CaptureDigest> ReadDoneReport(const std::string& path, const std::string& capture,
                                                    const report::Origin& origin) {
  const Result<JsonDocument> document = ReadJsonFile(path, kLargestReport);
  if (!document) return std::nullopt;
  Result<report::ReportDigest> report = report::ReadReportDigest(document->root());
  if (!report || report->version != Version() || report->origin != origin || report->captures.size() != 1) {
    return std::nullopt;
  }
  report::CaptureDigest& digest = report->captures.front();
  if (!digest.unreadable.empty() || digest.path != report::PrintableLines(capture)) return std::nullopt;
  return std::move(digest);
}

}  // namespace ecaudit::cli
