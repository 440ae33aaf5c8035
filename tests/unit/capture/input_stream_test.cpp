#include "decoder/capture/input_stream.h"

#include <algorithm>
#include <array>
#include <fcntl.h>
#include <random>
#include <thread>
#include <unistd.h>

#include <gtest/gtest.h>
#include <zstd.h>

#include "tests/unit/capture/capture_test_support.h"

namespace ecaudit::capture {
namespace {

/// Bytes that compress a little, larger than all buffers together.
Bytes Sample(std::size_t size = 1'500'000) {
  std::mt19937 random(1);
  Bytes bytes(size);
  for (std::uint8_t& byte : bytes) byte = static_cast<std::uint8_t>(random() & 0x3FU);
  return bytes;
}

Bytes Drain(InputStream& stream) {
  Bytes out;
  for (;;) {
    const ByteSpan part = stream.Peek(1);
    if (part.empty()) return out;
    out.insert(out.end(), part.begin(), part.end());
    stream.Consume(part.size());
  }
}

Bytes Concat(const Bytes& a, const Bytes& b) {
  Bytes all = a;
  all.insert(all.end(), b.begin(), b.end());
  return all;
}

Bytes Start(const Bytes& bytes, std::size_t count) {
  return {bytes.begin(), bytes.begin() + static_cast<std::ptrdiff_t>(count)};
}

struct Read {
  Bytes bytes;
  std::string error;
  Compression compression;
};

Read ReadMemory(const Bytes& bytes, std::uint64_t limit = InputStream::kDefaultDecompressedLimit) {
  const auto stream = InputStream::FromMemory(bytes, limit);
  Bytes out = Drain(*stream);
  EXPECT_EQ(stream->offset(), out.size());
  return {std::move(out), stream->error(), stream->compression()};
}

TEST(InputStream, PlainBytesAsTheyAre) {
  const Bytes sample = Sample();
  const Read read = ReadMemory(sample);
  EXPECT_EQ(read.bytes, sample);
  EXPECT_EQ(read.error, "");
  EXPECT_EQ(read.compression, Compression::kNone);
}

TEST(InputStream, GzipAndZstd) {
  const Bytes sample = Sample();
  const Read gzip = ReadMemory(Gzip(sample));
  EXPECT_EQ(gzip.bytes, sample);
  EXPECT_EQ(gzip.error, "");
  EXPECT_EQ(gzip.compression, Compression::kGzip);
  const Read zstd = ReadMemory(Zstd(sample));
  EXPECT_EQ(zstd.bytes, sample);
  EXPECT_EQ(zstd.error, "");
  EXPECT_EQ(zstd.compression, Compression::kZstd);
}

TEST(InputStream, EmptyInputsAreEmpty) {
  for (const Bytes& empty : {Bytes{}, Gzip({}), Zstd({})}) {
    const Read read = ReadMemory(empty);
    EXPECT_TRUE(read.bytes.empty());
    EXPECT_EQ(read.error, "");
  }
}

TEST(InputStream, SeveralMembersAndFramesAreOneStream) {
  const Bytes a = Sample(300'000);
  const Bytes b = Sample(70'000);
  EXPECT_EQ(ReadMemory(Concat(Concat(Gzip(a), Gzip({})), Gzip(b))).bytes, Concat(a, b));
  EXPECT_EQ(ReadMemory(Concat(Concat(Zstd(a), Zstd({})), Zstd(b))).bytes, Concat(a, b));
  const Bytes skippable{0x50, 0x2A, 0x4D, 0x18, 3, 0, 0, 0, 9, 9, 9};
  const Read read = ReadMemory(Concat(skippable, Zstd(b)));
  EXPECT_EQ(read.bytes, b);
  EXPECT_EQ(read.error, "");
}

TEST(InputStream, ZerosAfterGzipArePadding) {
  const Bytes a = Sample(1000);
  const Read read = ReadMemory(Concat(Gzip(a), Bytes(512)));
  EXPECT_EQ(read.bytes, a);
  EXPECT_EQ(read.error, "");
}

TEST(InputStream, SomethingElseAfterTheCompressedData) {
  const Bytes a = Sample(1000);
  const Read gzip = ReadMemory(Concat(Gzip(a), {'t', 'e', 'x', 't', '!'}));
  EXPECT_EQ(gzip.bytes, a);
  EXPECT_EQ(gzip.error, "the gzip data are followed by other data");
  const Read zstd = ReadMemory(Concat(Zstd(a), {'t', 'e', 'x', 't', '!'}));
  EXPECT_EQ(zstd.bytes, a);
  EXPECT_TRUE(zstd.error.starts_with("the zstd data are damaged")) << zstd.error;
}

TEST(InputStream, CutCompressedDataGiveAllBeforeTheCut) {
  const Bytes sample = Sample();
  for (const bool gzip : {true, false}) {
    const Bytes compressed = gzip ? Gzip(sample) : Zstd(sample);
    for (const std::size_t length : {compressed.size() - 1, compressed.size() / 2, std::size_t{20}, std::size_t{5}}) {
      const Read read = ReadMemory(Start(compressed, length));
      EXPECT_EQ(read.error, gzip ? "the gzip data end early" : "the zstd data end early") << length;
      EXPECT_TRUE(std::equal(read.bytes.begin(), read.bytes.end(), sample.begin())) << length;
      // Blocks of at most 128 KiB are held back until they are whole.
      EXPECT_GE(read.bytes.size() + 131'072 * 2, sample.size() * length / compressed.size()) << length;
    }
  }
}

TEST(InputStream, FlippedBitsGiveAnErrorNotAnEnd) {
  const Bytes sample = Sample();
  Bytes gzip = Gzip(sample);
  gzip[gzip.size() - 6] ^= 1U;  // in the checksum: all data are good, and yet they cannot be trusted
  const Read checksum = ReadMemory(gzip);
  EXPECT_EQ(checksum.bytes, sample);
  EXPECT_EQ(checksum.error, "the gzip data are damaged (incorrect data check)");

  Bytes zstd = Zstd(sample);
  std::fill_n(zstd.begin() + static_cast<std::ptrdiff_t>(zstd.size() / 2), 64, std::uint8_t{0xFF});
  const Read read = ReadMemory(zstd);
  EXPECT_TRUE(read.error.starts_with("the zstd data are damaged (")) << read.error;
  EXPECT_LT(read.bytes.size(), sample.size());
}

TEST(InputStream, DecompressionBombsEndAtTheLimit) {
  const Bytes zeros(1'000'000);
  for (const Bytes& bomb : {Gzip(zeros), Zstd(zeros)}) {
    ASSERT_LT(bomb.size(), 10'000U);
    const Read read = ReadMemory(bomb, 300'000);
    EXPECT_EQ(read.bytes.size(), 300'000U);
    EXPECT_EQ(read.error, "the compressed data expand to more than 300,000 bytes");
    const Read enough = ReadMemory(bomb, 1'000'000);
    EXPECT_EQ(enough.bytes.size(), 1'000'000U);
    EXPECT_EQ(enough.error, "");
  }
  EXPECT_EQ(ReadMemory(zeros, 300'000).bytes.size(), 1'000'000U);  // plain data expand to nothing
}

TEST(InputStream, DecompressionBombsEndWhereTheyExpandTooMuch) {
  constexpr std::uint64_t kMiB = 1ULL << 20U;
  for (const Bytes& block : {Gzip(Bytes(16 * kMiB)), Zstd(Bytes(16 * kMiB))}) {
    Bytes bomb;
    for (int i = 0; i < 40; ++i) bomb.insert(bomb.end(), block.begin(), block.end());  // members one behind the other
    const auto stream = InputStream::FromMemory(bomb);
    std::uint64_t total = 0;
    while (const std::size_t got = stream->Peek(1).size()) {
      total += got;
      stream->Consume(got);
    }
    EXPECT_EQ(stream->error(), "the compressed data expand to more than 200 times their size");
    EXPECT_GE(total, 256 * kMiB) << "small files may expand as they like";
    EXPECT_LE(total, 300 * kMiB);
  }
}

TEST(InputStream, ZstdWindowAbove128MiBIsRefused) {
  // A frame header alone: magic, descriptor without content size, window descriptor of 2^(10+18) bytes, and one raw
  // block (last, 1 byte).
  const auto frame = [](std::uint8_t exponent) {
    return Bytes{0x28, 0xB5, 0x2F, 0xFD, 0, static_cast<std::uint8_t>(exponent << 3U), 0x09, 0, 0, 'x'};
  };
  EXPECT_EQ(ReadMemory(frame(17)).bytes, Bytes{'x'});
  const Read read = ReadMemory(frame(18));
  EXPECT_TRUE(read.bytes.empty());
  EXPECT_TRUE(read.error.starts_with("the zstd data are damaged (")) << read.error;
}

TEST(InputStream, PeekShowsWhatIsThereWithoutTakingIt) {
  const Bytes sample = Sample();
  const auto stream = InputStream::FromMemory(sample);
  EXPECT_TRUE(std::ranges::equal(Slice(stream->Peek(10), 0, 10), Slice(sample, 0, 10)));
  EXPECT_EQ(stream->offset(), 0U);
  stream->Consume(3);
  EXPECT_EQ(stream->offset(), 3U);
  // More than the window holds at first.
  const ByteSpan large = stream->Peek(1'000'000);
  ASSERT_GE(large.size(), 1'000'000U);
  EXPECT_TRUE(std::equal(large.begin(), large.end(), sample.begin() + 3));
  EXPECT_EQ(stream->Peek(2'000'000).size(), sample.size() - 3);
  EXPECT_EQ(stream->error(), "");
}

TEST(InputStream, SkipsAlsoWhatItDoesNotHold) {
  const Bytes sample = Sample();
  const auto stream = InputStream::FromMemory(sample);
  ASSERT_TRUE(stream->Skip(1'000'000));
  EXPECT_EQ(stream->offset(), 1'000'000U);
  EXPECT_TRUE(std::ranges::equal(Slice(stream->Peek(7), 0, 7), Slice(sample, 1'000'000, 7)));
  EXPECT_FALSE(stream->Skip(sample.size()));
  EXPECT_EQ(stream->offset(), sample.size());
  EXPECT_TRUE(stream->Peek(1).empty());
}

TEST(InputStream, CountsTheBytesOfTheFile) {
  const TempFolder folder;
  const Bytes compressed = Gzip(Sample());
  auto stream = InputStream::Open(folder.Write("x.gz", compressed));
  ASSERT_TRUE(stream);
  EXPECT_EQ((*stream)->bytes_total(), compressed.size());
  EXPECT_LE((*stream)->bytes_read(), compressed.size() / 2);
  EXPECT_EQ(Drain(**stream).size(), 1'500'000U);
  EXPECT_EQ((*stream)->bytes_read(), compressed.size());
}

TEST(InputStream, APipeInSmallPieces) {
  const Bytes sample = Sample(400'000);
  const Bytes compressed = Gzip(sample);
  std::array<int, 2> ends{};
  ASSERT_EQ(::pipe(ends.data()), 0);
  std::thread writer([&] {
    for (std::size_t at = 0; at < compressed.size();) {
      const std::size_t count = std::min<std::size_t>(at < 8 ? 1 : 3001, compressed.size() - at);
      const ssize_t written = ::write(ends[1], compressed.data() + at, count);
      if (written <= 0) break;
      at += static_cast<std::size_t>(written);
    }
    ::close(ends[1]);
  });
  const auto stream = InputStream::FromFd(ends[0], true);
  EXPECT_EQ(Drain(*stream), sample);
  EXPECT_EQ(stream->error(), "");
  EXPECT_EQ(stream->bytes_total(), 0U);
  EXPECT_EQ(stream->bytes_read(), compressed.size());
  writer.join();
}

TEST(InputStream, AFileThatCannotBeReadOnReportsWhy) {
  const TempFolder folder;
  const int fd = ::open(folder.Path(".").c_str(), O_RDONLY | O_DIRECTORY);
  ASSERT_GE(fd, 0);
  const auto stream = InputStream::FromFd(fd, true);
  EXPECT_TRUE(Drain(*stream).empty());
  EXPECT_TRUE(stream->error().starts_with("cannot read on: ")) << stream->error();
}

}  // namespace
}  // namespace ecaudit::capture
