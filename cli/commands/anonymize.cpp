/// `ecaudit anonymize`: a copy that may leave the house, evaluated as the capture is.
#include <algorithm>
#include <cerrno>
#include <cstdint>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "analyzers/analysis.h"
#include "analyzers/judge/catalogue.h"
#include "cli/anonymize/frame_cleaner.h"
#include "cli/capture_options.h"
#include "cli/command_files.h"
#include "cli/commands/command.h"
#include "cli/interrupt.h"
#include "cli/output_file.h"
#include "cli/progress.h"
#include "cli/stream/spool.h"
#include "cli/version.h"
#include "decoder/base/system/files.h"
#include "decoder/base/text.h"
#include "decoder/capture/capture_reader.h"
#include "decoder/capture/pcapng_writer.h"

namespace ecaudit::cli {
namespace {

constexpr std::size_t kCopiedBytes = std::size_t{1} << 20U;

/// Of the file, or of the packets that are removed, not of the bus.
bool IsOfCopy(const Finding& finding) {
  if (finding.rule == "capture-truncated") return false;  // the copy is whole
  const RuleInfo* const rule = FindRule(finding.rule);
  return rule == nullptr || rule->subject != Subject::kOtherPackets;
}

/// A finding without its words: names that are gone may stand in them.
std::vector<std::string> Facts(const AnalysisResult& result) {
  std::vector<std::string> facts;
  for (const Finding& finding : result.findings) {
    if (!IsOfCopy(finding)) continue;
    std::string fact = std::string(finding.rule) + " " + std::string(Name(finding.severity));
    fact += finding.slave == kNoSlave ? "" : ", slave " + std::to_string(finding.slave);
    fact += ", frame " + std::to_string(finding.first.number) + " to " + std::to_string(finding.last.number) + ", " +
            std::to_string(finding.count) + " times";
    facts.push_back(std::move(fact));
  }
  std::ranges::sort(facts);
  return facts;
}

/// The first that only one of them has; empty: both have the same.
std::string FirstDifference(const std::vector<std::string>& a, const std::vector<std::string>& b) {
  std::vector<std::string> differing;
  std::set_symmetric_difference(a.begin(), a.end(), b.begin(), b.end(), std::back_inserter(differing));
  return differing.empty() ? std::string() : differing.front();
}

class AnonymizeCommand : public Command {
 public:
  AnonymizeCommand()
      : Command("anonymize", "anonymize CAPTURE", "Copy a capture without the names of people, places and devices") {}

  void Declare(OptionSet& options) override {
    capture_.Declare(options);
    options.Group("Output");
    options.Values("-o,--output", "PATH", outputs_, "the pcapng file to write");
    options.Flag("--force", force_, "overwrite PATH when it exists");
    options.Footer(
        "\nRemoved: other traffic (empty packets of the same size stay), network frames over the mailbox (EoE), "
        "file\n"
        "names and contents (FoE), MAC and IP addresses, serial numbers, names and versions of devices and all other\n"
        "texts in EEPROM and objects, contents of vendor messages, names of interfaces, comments.\n"
        "Kept: sizes, times, addresses, working counters, states, configuration, process data, vendor and product "
        "code,\n"
        "names of objects that devices list. Both captures are checked; if a finding differs, nothing is written.\n"
        "Example: ecaudit anonymize trace.pcapng -o to-the-vendor.pcapng");
  }

  [[nodiscard]] ExitStatus Run(Console& console) override {
    if (capture_.captures.size() > 1 && !capture_.join) {
      return Fail(console, Error{"anonymize reads one capture; give --join when these are files of one ring buffer"});
    }
    if (outputs_.size() != 1) return Fail(console, Error{"give the pcapng file to write with exactly one -o PATH"});
    const std::string& output = outputs_.front();
    if (output == "-")
      return Fail(console, Error{"the copy is checked before it is released: give -o the name of a file"});
    const std::string& capture = capture_.captures.front();
    if (std::ranges::find(capture_.captures, "-") != capture_.captures.end()) {
      return Fail(console, Error{"the capture is read three times: name a file, not standard input"});
    }
    const Result<Settings> settings = ResolveSettings(capture_, {}, capture);
    if (!settings) return Fail(console, settings.error());
    capture_.ReportSkipped(console);
    CommandFiles files;
    if (const auto error = AddFiles(capture_, files)) return Fail(console, *error);
    AddFiles(*settings, files);
    const std::string unchecked = output + ".unchecked";
    const bool there = system::IsFile(output);
    if (there && !force_) return Fail(console, Error{Printable(output) + " exists; give --force to overwrite it"});
    if (auto error = there ? files.Claims(output) : files.Writes(output)) return Fail(console, *error);
    if (auto error = files.Writes(unchecked)) return Fail(console, *error);

    ListenForInterrupt();
    const ExitStatus status = Work(console, *settings, unchecked, output);
    system::Remove(unchecked);
    return status;
  }

 private:
  [[nodiscard]] auto Open(const std::vector<std::string>& paths) const {
    return paths.size() > 1 ? capture::OpenJoined(paths, &InterruptFlag())
                            : capture::OpenCapture(paths.front(), &InterruptFlag());
  }

  [[nodiscard]] Result<AnalysisResult> Evaluate(Console& console, const Settings& settings,
                                                const std::vector<std::string>& paths, const std::string& what) const {
    auto source = CapturePaths(paths, settings.analysis.interfaces).Open();
    if (!source) return source.error();
    AnalysisOptions analysis = settings.analysis;
    analysis.stop = &InterruptFlag();
    Progress progress(console, what);
    analysis.progress = [&progress](std::uint64_t done, std::uint64_t total, std::uint64_t packets) {
      progress.Update(done, total, packets);
    };
    AnalysisResult result = Analyse(**source, analysis);
    progress.Clear();
    return result;
  }

  [[nodiscard]] ExitStatus Work(Console& console, const Settings& settings, const std::string& unchecked,
                                const std::string& output) const {
    Result<AnalysisResult> evaluated = Evaluate(console, settings, capture_.captures, "the capture");
    if (!evaluated) return Fail(console, evaluated.error());
    const std::uint64_t packets = evaluated->capture.packets;
    const std::vector<std::string> facts = Facts(*evaluated);
    const std::size_t left_out = evaluated->findings.size() - facts.size();
    const std::vector<capture::Interface> interfaces = std::move(evaluated->capture.file.interfaces);
    evaluated = AnalysisResult();  // two results of thousands of slaves are large
    anonymize::FrameCleaner cleaner;
    if (auto error = Copy(console, interfaces, unchecked, cleaner)) return Fail(console, *error);
    const Result<AnalysisResult> after = InterruptFlag() ? Result<AnalysisResult>(AnalysisResult())
                                                         : Evaluate(console, settings, {unchecked}, "the copy");
    if (InterruptFlag()) {
      console.Error("interrupted; nothing was written");
      return ExitStatus::kInterrupted;
    }
    if (!after) return Fail(console, after.error());
    const std::string& capture = capture_.captures.front();
    if (packets != after->capture.packets) {
      return Fail(console,
                  Error{Printable(capture) + ": the copy has a different number of packets; nothing was written"});
    }
    if (const std::string difference = FirstDifference(facts, Facts(*after)); !difference.empty()) {
      return Fail(console,
                  Error{Printable(capture) + ": the copy would have other findings (" + difference +
                        "); nothing was written. A family that is recognised by the device name needs --profile"});
    }
    if (auto error = CheckSecrets(unchecked, cleaner)) return Fail(console, *error);
    if (!system::MoveOver(unchecked, output)) {
      return Fail(console, Error{Printable(output) + ": " + system::ReasonText(errno)});
    }
    return ReportResult(console, output, cleaner, packets, facts.size(), left_out);
  }

  [[nodiscard]] std::optional<Error> Copy(Console& console, std::vector<capture::Interface> interfaces,
                                          const std::string& path, anonymize::FrameCleaner& cleaner) const {
    capture::CapturedFrame frame;
    {
      auto source = Open(capture_.captures);
      if (!source) return source.error();
      while (!InterruptFlag() && (*source)->Next(frame) == capture::ReadStatus::kFrame) cleaner.Learn(frame);
    }
    cleaner.EndLearning();
    auto source = Open(capture_.captures);
    if (!source) return source.error();
    Result<OutputFile> file = OutputFile::Create(path);
    if (!file) return file.error();
    std::string buffer;
    capture::PcapngWriter writer(buffer);
    writer.BeginSection("ecaudit " + std::string(Version()), "Anonymized copy");
    for (std::size_t i = 0; i < interfaces.size(); ++i) {
      if (!interfaces[i].name.empty()) interfaces[i].name = "interface " + std::to_string(i);
      writer.AddInterface(interfaces[i]);
    }
    Progress progress(console, "copying");
    std::vector<std::uint8_t> bytes;
    std::uint64_t read = 0;
    while (!InterruptFlag() && (*source)->Next(frame) == capture::ReadStatus::kFrame) {
      if ((++read & 0xFFFFU) == 0) progress.Update((*source)->bytes_read(), (*source)->bytes_total(), read);
      bytes.assign(frame.bytes.begin(), frame.bytes.end());
      cleaner.Clean(frame, bytes);
      capture::CapturedFrame clean = frame;
      clean.bytes = bytes;
      writer.AddPacket(clean, {});
      if (buffer.size() < kCopiedBytes) continue;
      if (auto error = file->Write(buffer)) return error;
      buffer.clear();
    }
    progress.Clear();
    writer.AddStatistics(interfaces);
    if (auto error = file->Write(buffer)) return error;
    return file->Finish();
  }

  /// What was found to be a name anywhere must be nowhere.
  [[nodiscard]] std::optional<Error> CheckSecrets(const std::string& path,
                                                  const anonymize::FrameCleaner& cleaner) const {
    auto source = capture::OpenCapture(path, &InterruptFlag());
    if (!source) return source.error();
    capture::CapturedFrame frame;
    while ((*source)->Next(frame) == capture::ReadStatus::kFrame) {
      if (!anonymize::HoldsSecret(frame.bytes, cleaner.secrets())) continue;
      return Error{Printable(capture_.captures.front()) + ": a name that was removed elsewhere is still in frame " +
                   std::to_string(frame.number) + "; nothing was written"};
    }
    return std::nullopt;
  }

  [[nodiscard]] static ExitStatus ReportResult(Console& console, const std::string& output,
                                               const anonymize::FrameCleaner& cleaner, std::uint64_t packets,
                                               std::size_t findings, std::size_t left_out) {
    const anonymize::Removed& removed = cleaner.removed();
    std::string text =
        Printable(output) + ": " + Count(packets, "packet") + ", same findings as the capture (" +
        Count(findings, "finding") + ")" +
        (left_out > 0 ? " but for " + Count(left_out, "finding") + " about the file or other traffic" : "") +
        "\nremoved: " + std::to_string(cleaner.addresses()) +
        (cleaner.addresses() == 1 ? " MAC address" : " MAC addresses");
    const auto add = [&text](std::uint64_t count, std::string_view what) {
      if (count > 0) text += ", " + Count(count, what);
    };
    add(removed.other_packets, "other packet");
    add(removed.eeprom_words, "EEPROM word");
    add(removed.sdo_values, "SDO value");
    add(removed.network_frames, "EoE message");
    add(removed.file_parts, "FoE message");
    add(removed.other_messages, "other mailbox message");
    text += "\n";
    if (const auto error = console.Write(text)) return Fail(console, *error);
    return ExitStatus::kClean;
  }

  CaptureOptions capture_;
  std::vector<std::string> outputs_;
  bool force_ = false;
};

}  // namespace

std::unique_ptr<Command> MakeAnonymizeCommand() {
  return std::make_unique<AnonymizeCommand>();
}

}  // namespace ecaudit::cli
