#include "decoder/capture/joined_source.h"

#include <algorithm>
#include <limits>
#include <map>
#include <optional>
#include <set>
#include <tuple>
#include <utility>
#include <vector>

#include "decoder/base/allowance.h"
#include "decoder/capture/capture_reader.h"
#include "decoder/capture/capture_stream.h"

namespace ecaudit::capture {
namespace {

constexpr TimeNs kBeforeAll = std::numeric_limits<TimeNs>::min();
constexpr std::size_t kMaxJoinedComments = 1000;
constexpr std::size_t kMaxJoinedInterfaces = 65535;
constexpr std::size_t kMaxNamedDamages = 10;

/// What makes interfaces of two files the same one; the last is its ordinal among the equal ones of its file.
using InterfaceKey = std::tuple<std::string, std::uint16_t, std::uint32_t, std::int64_t, std::size_t>;

/// One of the joined files.
struct File {
  std::string path;
  std::uint64_t size = 0;
  TimeNs key = kBeforeAll;              // where its next packet belongs
  std::unique_ptr<FrameSource> source;  // only while its packets are due
  CapturedFrame head;                   // its next packet
  bool has_head = false;
  std::vector<std::uint16_t> interfaces;  // ours for each of the file's
  std::map<InterfaceKey, std::size_t> equal_interfaces;
  std::size_t comments_taken = 0;
};

class JoinedSource final : public FrameSource {
 public:
  explicit JoinedSource(const std::atomic<bool>* stop) : stop_(stop) {}
  /// @return what is wrong with one of the files; empty when nothing is
  std::optional<Error> Open(std::span<const std::string> paths);

  ReadStatus Next(CapturedFrame& frame) noexcept override;
  const CaptureInfo& info() const noexcept override { return info_; }
  std::uint64_t bytes_read() const noexcept override;
  std::uint64_t bytes_total() const noexcept override { return total_; }

 private:
  /// Heap order: the earliest on top, the lower rank with equal stamps.
  bool Later(std::size_t a, std::size_t b) const {
    return files_[a].key != files_[b].key ? files_[a].key > files_[b].key : a > b;
  }
  [[nodiscard]] bool stopped() const { return stop_ != nullptr && stop_->load(std::memory_order_relaxed); }
  void Push(std::size_t rank);
  void OpenDueFiles();
  /// Reads the next packet of a file and puts the file back into the heap, or closes it after its last one.
  void Advance(std::size_t rank);
  void Close(File& file);
  void AddDamage(const File& file, const std::string& message, std::uint64_t offset);
  /// Of the next interface of a file.
  static InterfaceKey KeyOf(File& file, const Interface& interface);
  /// False when there are too many interfaces.
  bool MapInterfaces(File& file);
  void TakeComments(File& file, FrameNo head_number);

  const std::atomic<bool>* stop_;
  CaptureInfo info_;
  Allowance name_bytes_{CaptureInfo::kNameBytes};
  std::map<InterfaceKey, std::size_t> interfaces_;
  std::vector<File> files_;          // by time of the first packet: the index is the rank
  std::size_t next_file_ = 0;        // the first one that was not opened yet
  std::vector<std::size_t> heap_;    // ranks of the files with a packet to give
  std::optional<std::size_t> lent_;  // the file whose packet the caller holds
  std::uint64_t finished_bytes_ = 0;
  std::uint64_t total_ = 0;
  std::size_t damaged_files_ = 0;
};

std::optional<Error> JoinedSource::Open(std::span<const std::string> paths) {
  if (paths.empty()) return Error{"no captures to join"};
  bool sizes_known = true;
  std::set<std::string> formats;
  for (const std::string& path : paths) {
    File file;
    file.path = path;
    Result<std::unique_ptr<FrameSource>> source = OpenCapture(path, stop_);
    if (!source) return source.error();
    file.source = std::move(*source);
    file.has_head = file.source->Next(file.head) == ReadStatus::kFrame;
    if (file.has_head && file.head.has_time) file.key = file.head.time;
    file.size = file.source->bytes_total();
    info_.path += (info_.path.empty() ? "" : ", ") + path;
    formats.insert(file.source->info().format);
    total_ += file.size;
    // A ring buffer may have more files than a process may hold open. A pipe has no size and no second chance, nor
    // has standard input, wherever it comes from.
    if (file.size != 0 && path != "-") {
      file.source.reset();
    } else if (file.size == 0) {
      sizes_known = false;
    }
    files_.push_back(std::move(file));
  }
  if (!sizes_known) total_ = 0;
  for (const std::string& format : formats) info_.format += (info_.format.empty() ? "" : ", ") + format;
  std::ranges::stable_sort(files_, {}, &File::key);
  return std::nullopt;
}

ReadStatus JoinedSource::Next(CapturedFrame& frame) noexcept {
  if (lent_) Advance(*std::exchange(lent_, std::nullopt));
  OpenDueFiles();
  if (heap_.empty()) return damaged_files_ > 0 ? ReadStatus::kDamaged : ReadStatus::kEnd;
  const auto later = [this](std::size_t a, std::size_t b) { return Later(a, b); };
  std::pop_heap(heap_.begin(), heap_.end(), later);
  const std::size_t rank = heap_.back();
  heap_.pop_back();
  File& file = files_[rank];
  lent_ = rank;
  frame = file.head;
  frame.number = ++info_.packets;
  frame.interface_index = file.interfaces[file.head.interface_index];
  TakeComments(file, frame.number);
  return ReadStatus::kFrame;
}

void JoinedSource::Push(std::size_t rank) {
  heap_.push_back(rank);
  std::push_heap(heap_.begin(), heap_.end(), [this](std::size_t a, std::size_t b) { return Later(a, b); });
}

void JoinedSource::OpenDueFiles() {
  while (!stopped() && next_file_ < files_.size() &&
         (heap_.empty() || files_[next_file_].key <= files_[heap_.front()].key)) {
    const std::size_t rank = next_file_++;
    File& file = files_[rank];
    if (file.source == nullptr) {
      Result<std::unique_ptr<FrameSource>> source = OpenCapture(file.path, stop_);
      if (!source) {
        if (!stopped()) AddDamage(file, source.error().message, 0);
        continue;
      }
      file.source = std::move(*source);
      Advance(rank);
    } else if (file.has_head && MapInterfaces(file)) {
      Push(rank);
    } else {
      Close(file);
    }
  }
}

void JoinedSource::Advance(std::size_t rank) {
  File& file = files_[rank];
  if (file.source->Next(file.head) != ReadStatus::kFrame || !MapInterfaces(file)) {
    Close(file);
    return;
  }
  if (file.head.has_time) file.key = file.head.time;
  Push(rank);
}

void JoinedSource::Close(File& file) {
  MapInterfaces(file);
  TakeComments(file, 0);
  const CaptureInfo& info = file.source->info();
  for (std::size_t i = 0; i < file.interfaces.size(); ++i) {
    std::optional<std::uint64_t>& dropped = info_.interfaces[file.interfaces[i]].dropped;
    if (info.interfaces[i].dropped) dropped = std::max(dropped.value_or(0), *info.interfaces[i].dropped);
  }
  if (info.damage) {
    AddDamage(file, info.damage->message, info.damage->offset);
  } else if (file.interfaces.size() < info.interfaces.size()) {
    AddDamage(file, "there are more than 65,535 interfaces", 0);
  }
  info_.name_bytes_left_out += info.name_bytes_left_out;
  finished_bytes_ += file.source->bytes_read();
  file.source.reset();
  file.equal_interfaces.clear();
}

void JoinedSource::AddDamage(const File& file, const std::string& message, std::uint64_t offset) {
  ++damaged_files_;
  const std::string text = DisplayName(file.path) + ": " + message;
  if (!info_.damage) {
    info_.damage = Damage{text, offset, info_.packets};
  } else if (damaged_files_ <= kMaxNamedDamages) {
    info_.damage->message += "; " + text;
  } else if (damaged_files_ == kMaxNamedDamages + 1) {
    info_.damage->message += "; and more files";
  }
}

InterfaceKey JoinedSource::KeyOf(File& file, const Interface& interface) {
  InterfaceKey key{interface.name, interface.link_type, interface.snap_length, interface.resolution_ns, 0};
  std::get<std::size_t>(key) = file.equal_interfaces[key]++;
  return key;
}

bool JoinedSource::MapInterfaces(File& file) {
  const std::vector<Interface>& theirs = file.source->info().interfaces;
  while (file.interfaces.size() < theirs.size()) {
    Interface interface = theirs[file.interfaces.size()];
    InterfaceKey key = KeyOf(file, interface);
    if (!interfaces_.contains(key) && !name_bytes_.Take(interface.name.size())) {
      info_.name_bytes_left_out += interface.name.size();
      interface.name = {};
      key = KeyOf(file, interface);
    }
    const auto [ours, is_new] = interfaces_.try_emplace(std::move(key), info_.interfaces.size());
    if (is_new) {
      if (ours->second >= kMaxJoinedInterfaces) {
        interfaces_.erase(ours);
        return false;
      }
      info_.interfaces.push_back(interface);
      info_.interfaces.back().dropped.reset();
    }
    file.interfaces.push_back(static_cast<std::uint16_t>(ours->second));
  }
  return true;
}

void JoinedSource::TakeComments(File& file, FrameNo head_number) {
  const std::vector<Comment>& comments = file.source->info().comments;
  for (; file.comments_taken < comments.size(); ++file.comments_taken) {
    const Comment& comment = comments[file.comments_taken];
    const bool of_packet = comment.frame != 0;
    if (info_.comments.size() >= kMaxJoinedComments) continue;
    const bool known = !of_packet && std::ranges::any_of(info_.comments, [&](const Comment& c) {
      return c.frame == 0 && c.text == comment.text;
    });
    if (!known) info_.comments.push_back({of_packet ? head_number : 0, comment.text});
  }
}

std::uint64_t JoinedSource::bytes_read() const noexcept {
  std::uint64_t bytes = finished_bytes_;
  for (const std::size_t rank : heap_) bytes += files_[rank].source->bytes_read();
  if (lent_) bytes += files_[*lent_].source->bytes_read();
  return bytes;
}

}  // namespace

Result<std::unique_ptr<FrameSource>> OpenJoinedFiles(std::span<const std::string> paths,
                                                     const std::atomic<bool>* stop) {
  auto source = std::make_unique<JoinedSource>(stop);
  if (const std::optional<Error> error = source->Open(paths)) return *error;
  return std::unique_ptr<FrameSource>(std::move(source));
}

Result<std::unique_ptr<FrameSource>> OpenJoined(std::span<const std::string> paths, const std::atomic<bool>* stop) {
  return OpenJoinedFiles(paths, stop);
}

}  // namespace ecaudit::capture
