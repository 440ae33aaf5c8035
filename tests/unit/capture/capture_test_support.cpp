#include "tests/unit/capture/capture_test_support.h"

#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <iterator>
#include <unistd.h>
#include <utility>

#include <gtest/gtest.h>
#include <zlib.h>
#include <zstd.h>

#include "decoder/capture/capture_reader.h"
#include "tests/support/folders.h"

namespace ecaudit::capture {
namespace {

/// "1795230943.188860580" as nanoseconds.
TimeNs ParseEpoch(const std::string& text) {
  const std::size_t point = text.find('.');
  std::string fraction = point == std::string::npos ? "" : text.substr(point + 1);
  fraction.resize(9, '0');
  return std::stoll(text.substr(0, point)) * 1'000'000'000 + std::stoll(fraction);
}

}  // namespace

WholeCapture ReadAll(Result<std::unique_ptr<FrameSource>> source) {
  WholeCapture whole;
  if (!source) {
    whole.error = source.error().message;
    return whole;
  }
  CapturedFrame frame;
  while ((whole.end = (*source)->Next(frame)) == ReadStatus::kFrame) {
    whole.frames.push_back({frame.number, frame.time, frame.has_time, frame.link_type, frame.interface_index,
                            frame.flag, frame.original_length, Bytes(frame.bytes.begin(), frame.bytes.end())});
  }
  EXPECT_EQ((*source)->Next(frame), whole.end);
  whole.info = (*source)->info();
  EXPECT_EQ(whole.info.damage.has_value(), whole.end == ReadStatus::kDamaged);
  EXPECT_EQ(whole.info.packets, whole.frames.size());
  return whole;
}

WholeCapture ReadFile(const std::string& path) {
  return ReadAll(OpenCapture(path));
}

Bytes FileBytes(const std::string& path) {
  std::ifstream file(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>()};
}

Bytes Gzip(ByteSpan bytes) {
  z_stream state{};
  deflateInit2(&state, Z_BEST_SPEED, Z_DEFLATED, MAX_WBITS + 16, 8, Z_DEFAULT_STRATEGY);
  Bytes out(deflateBound(&state, bytes.size()) + 64);
  state.next_in = const_cast<Bytef*>(bytes.data());
  state.avail_in = static_cast<uInt>(bytes.size());
  state.next_out = out.data();
  state.avail_out = static_cast<uInt>(out.size());
  EXPECT_EQ(deflate(&state, Z_FINISH), Z_STREAM_END);
  const Bytes compressed(out.data(), state.next_out);
  deflateEnd(&state);
  return compressed;
}

Bytes Zstd(ByteSpan bytes) {
  Bytes out(ZSTD_compressBound(bytes.size()));
  ZSTD_CCtx* context = ZSTD_createCCtx();
  ZSTD_CCtx_setParameter(context, ZSTD_c_checksumFlag, 1);  // as the zstd program does
  const std::size_t size = ZSTD_compress2(context, out.data(), out.size(), bytes.data(), bytes.size());
  ZSTD_freeCCtx(context);
  EXPECT_EQ(ZSTD_isError(size), 0U);
  return {out.data(), out.data() + size};
}

TempFolder::TempFolder() {
  std::string name = (std::filesystem::temp_directory_path() / "ecaudit-test-XXXXXX").string();
  EXPECT_NE(::mkdtemp(name.data()), nullptr);
  folder_ = name;
}

TempFolder::~TempFolder() {
  std::error_code ignored;
  std::filesystem::remove_all(folder_, ignored);
}

std::string TempFolder::Path(std::string_view name) const {
  return (folder_ / name).string();
}

std::string TempFolder::Write(std::string_view name, ByteSpan bytes) const {
  const std::string path = Path(name);
  std::ofstream file(path, std::ios::binary);
  file.write(reinterpret_cast<const char*>(bytes.data()), static_cast<std::streamsize>(bytes.size()));
  EXPECT_TRUE(file.good());
  return path;
}

std::string SharedCapture(const std::string& name) {
  const std::string path = test::SharedDir() + "/captures/" + name;
  return std::filesystem::exists(path) ? path : std::string();
}

bool HaveTshark() {
  static const bool have = std::system("tshark --version >/dev/null 2>&1") == 0;
  return have;
}

std::vector<TsharkFrame> TsharkFrames(const std::string& path) {
  std::vector<TsharkFrame> frames;
  const std::string command =
      "tshark --disable-protocol eth --disable-protocol sll -r '" + path +
      "' -T fields -e frame.number -e frame.time_epoch -e frame.len -e frame.cap_len 2>/dev/null";
  FILE* pipe = ::popen(command.c_str(), "r");
  if (pipe == nullptr) return frames;
  char line[256];
  while (std::fgets(line, sizeof line, pipe) != nullptr) {
    std::vector<std::string> columns{""};
    for (const char* c = line; *c != '\0' && *c != '\n'; ++c) {
      if (*c == '\t') {
        columns.emplace_back();
      } else {
        columns.back() += *c;
      }
    }
    columns.resize(4);
    TsharkFrame frame;
    frame.number = std::stoull(columns[0]);
    frame.has_time = !columns[1].empty();
    if (frame.has_time) frame.time = ParseEpoch(columns[1]);
    frame.length = static_cast<std::uint32_t>(std::stoul(columns[2]));
    frame.captured = static_cast<std::uint32_t>(std::stoul(columns[3]));
    frames.push_back(frame);
  }
  ::pclose(pipe);
  return frames;
}

}  // namespace ecaudit::capture
