#include "cli/stream/spool.h"

#include <array>
#include <cerrno>
#include <filesystem>
#include <system_error>

#include "cli/interrupt.h"
#include "decoder/base/system/files.h"
#include "decoder/bus/aligned_source.h"
#include "decoder/capture/byte_reader.h"
#include "decoder/capture/capture_reader.h"
#include "decoder/capture/capture_stream.h"
#include "decoder/capture/interface_filter.h"

namespace ecaudit::cli {
namespace {

Error Failed(const std::string& what) {
  return Error{what + ": " + std::generic_category().message(errno)};
}

}  // namespace

Spool::Spool(int fd, std::string path) : fd_(fd), path_(std::move(path)) {}

Spool::~Spool() {
  system::Close(fd_);
}

bool Spool::CanBeReadTwice(const std::string& path) {
  std::error_code ignored;
  return path != "-" && !std::filesystem::is_fifo(path, ignored) &&
         !std::filesystem::is_character_file(path, ignored) && !std::filesystem::is_socket(path, ignored);
}

Result<std::unique_ptr<Spool>> Spool::Read(const std::string& path) {
  const bool standard = path == "-";
  const int in = standard ? system::kStandardInput : capture::OpenToRead(path, &InterruptFlag());
  if (in < 0) return Failed("cannot read " + capture::DisplayName(path));
  const std::unique_ptr<capture::ByteReader> reader = capture::MakeFdReader(in, !standard, &InterruptFlag());

  system::Nameless file = system::MakeNameless();
  if (file.fd < 0) return Failed("cannot keep the capture in " + file.path);
  std::unique_ptr<Spool> spool(new Spool(file.fd, std::move(file.path)));
  std::array<std::uint8_t, 1U << 16U> buffer;
  std::string error;
  while (const std::size_t got = reader->Read(buffer, error)) {
    const std::string_view piece(reinterpret_cast<const char*>(buffer.data()), got);
    if (!system::WriteAll(spool->fd_, piece)) return Failed("cannot keep the capture in a temporary file");
  }
  if (!error.empty()) return Error{capture::DisplayName(path) + ": " + error};
  return spool;
}

std::optional<Error> CapturePaths::MakeReadableTwice() {
  for (std::string& path : paths_) {
    if (Spool::CanBeReadTwice(path)) continue;
    Result<std::unique_ptr<Spool>> spool = Spool::Read(path);
    if (!spool) return spool.error();
    path = (*spool)->path();
    spools_.push_back(std::move(*spool));
  }
  return std::nullopt;
}

Result<std::unique_ptr<capture::FrameSource>> CapturePaths::Open(const std::atomic<bool>* stop) const {
  if (stop == nullptr) stop = &InterruptFlag();
  const auto open = [&] {
    auto opened = paths_.size() > 1 ? capture::OpenJoined(paths_, stop) : capture::OpenCapture(paths_.front(), stop);
    if (opened && !interfaces_.empty()) {
      *opened = std::make_unique<capture::InterfaceFilter>(std::move(*opened), interfaces_);
    }
    return opened;
  };
  // Several files are one recording; their interfaces have one clock.
  const bool compare = paths_.size() == 1 && Spool::CanBeReadTwice(paths_.front());
  auto source = compare ? bus::OpenAligned(open) : open();
  if (!source) return WithoutSpools(source.error());
  return source;
}

Error CapturePaths::WithoutSpools(Error error) const {
  for (const auto& spool : spools_) {
    const std::size_t at = error.message.find(spool->path());
    if (at != std::string::npos) error.message.replace(at, spool->path().size(), "the input");
  }
  return error;
}

}  // namespace ecaudit::cli
