/// PATH arguments of commands that take many files: files, folders, wildcards.
#pragma once

#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "cli/report/report.h"
#include "decoder/base/result.h"

namespace ecaudit::cli {

struct FileList {
  std::vector<std::string> files;                     ///< sorted by path, each file once
  std::vector<report::UnreadableCapture> unreadable;  ///< folders that could not be read, and why
  std::vector<std::string> passed_over;               ///< what a folder holds besides that may be wanted, and why not
};

/// Expands `paths`. A folder becomes the wanted files in it and in the folders below (names that begin with a dot
/// and links to folders are passed over); a name with * ? or [ that is no file is a wildcard as in a shell; everything
/// else stays as it is, wanted or not. Paths are brought to their shortest form ("./a/../b.pcap" is "b.pcap").
///
/// @param wanted  shows by the file name which files of a folder are meant
/// @param noun    what they are, for messages: "capture"
/// @return fails when a folder holds no such file, or nothing matches a wildcard
[[nodiscard]] Result<FileList> ExpandPaths(std::span<const std::string> paths, bool (*wanted)(std::string_view name),
                                           std::string_view noun);

/// pcap, pcapng and cap files, numbered ones of tcpdump (.pcap3) too, compressed or not.
[[nodiscard]] bool IsCaptureName(std::string_view name);
/// Puts the files of each ring buffer together, in the order of the first of each: files of one folder whose names
/// differ in nothing but the numbers that dumpcap and Wireshark (trace_00003_20190501120000.pcapng) or tcpdump
/// (trace.pcap3) give them. Every other file stays alone.
[[nodiscard]] std::vector<std::vector<std::string>> GroupRingBuffers(std::span<const std::string> files);
/// A capture by its name that no program of this kind reads: packed by xz, bzip2, lz4 or zip.
[[nodiscard]] bool IsForeignCaptureName(std::string_view name);
/// JSON files.
[[nodiscard]] bool IsReportName(std::string_view name);

}  // namespace ecaudit::cli
