/// Drives a fuzz target without libFuzzer: each file given, or lying in a folder given, goes through it whole, and cut
/// at every byte (at 200 places in larger files); then `--mutations N` inputs made from them by flipping, overwriting,
/// inserting, repeating and joining. The same inputs in every run: a failure comes again. `--cuts N`: at N places
/// instead of 200. Exit code 1 when there was nothing to run.
///
/// `--keep FILE` writes each made input there before it is run, so that the one that crashed is at hand.
#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <random>
#include <string>
#include <string_view>
#include <vector>

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size);

namespace {

using Bytes = std::vector<std::uint8_t>;

/// Runs the first `size` of `bytes` from a copy of just that size, so that a sanitizer sees the first byte read behind
/// it.
void Run(const Bytes& bytes, std::size_t size) {
  const Bytes input(bytes.begin(), bytes.begin() + static_cast<std::ptrdiff_t>(size));
  LLVMFuzzerTestOneInput(input.data(), input.size());
}

void RunCut(const Bytes& bytes, std::size_t cuts) {
  Run(bytes, bytes.size());
  const std::size_t step = bytes.size() / std::max<std::size_t>(cuts, 1) + 1;
  for (std::size_t size = 0; size < bytes.size(); size += step) Run(bytes, size);
}

/// Makes inputs from others.
class Mutator {
 public:
  explicit Mutator(const std::vector<Bytes>& corpus) : corpus_(corpus) {}

  Bytes Next() {
    constexpr std::size_t kLargest = 1U << 16U;
    Bytes bytes = Any();
    for (std::size_t steps = 1U << Below(5); steps > 0; --steps) Change(bytes);
    if (bytes.size() > kLargest) bytes.resize(kLargest);
    return bytes;
  }

 private:
  /// 0 to limit - 1. Not std::uniform_int_distribution, which differs between libraries.
  std::size_t Below(std::size_t limit) { return limit == 0 ? 0 : static_cast<std::size_t>(random_() % limit); }
  const Bytes& Any() { return corpus_[Below(corpus_.size())]; }

  void Change(Bytes& bytes) {
    if (bytes.empty()) {
      bytes.push_back(static_cast<std::uint8_t>(random_()));
      return;
    }
    const std::size_t at = Below(bytes.size());
    const auto place = bytes.begin() + static_cast<std::ptrdiff_t>(at);
    const std::size_t length = 1 + Below(std::min<std::size_t>(bytes.size() - at, 64));
    const Bytes part(place, place + static_cast<std::ptrdiff_t>(length));
    switch (Below(7)) {
      case 0:
        *place = static_cast<std::uint8_t>(*place ^ 1U << Below(8));
        break;
      case 1: {
        constexpr std::uint8_t kEdges[] = {0x00, 0x01, 0x7F, 0x80, 0xFE, 0xFF};
        *place = kEdges[Below(std::size(kEdges))];
        break;
      }
      case 2:
        std::fill_n(place, length, static_cast<std::uint8_t>(random_()));
        break;
      case 3:
        bytes.erase(place, place + static_cast<std::ptrdiff_t>(length));
        break;
      case 4:  // a part once more
        bytes.insert(place, part.begin(), part.end());
        break;
      case 5: {  // a part somewhere else
        const std::size_t to = Below(bytes.size() - length + 1);
        std::copy(part.begin(), part.end(), bytes.begin() + static_cast<std::ptrdiff_t>(to));
        break;
      }
      default: {  // goes on as another one does
        const Bytes& other = Any();
        const std::size_t from = Below(other.size() + 1);
        bytes.resize(at);
        bytes.insert(bytes.end(), other.begin() + static_cast<std::ptrdiff_t>(from), other.end());
        break;
      }
    }
  }

  const std::vector<Bytes>& corpus_;
  std::mt19937 random_{0xECA7};
};

/// Files in the order of their names, so that every run does the same.
std::vector<std::filesystem::path> FilesOf(const std::vector<std::string>& arguments) {
  std::vector<std::filesystem::path> files;
  for (const std::string& argument : arguments) {
    if (!std::filesystem::is_directory(argument)) {
      files.emplace_back(argument);
      continue;
    }
    for (const auto& entry : std::filesystem::directory_iterator(argument)) {
      if (entry.is_regular_file()) files.push_back(entry.path());
    }
  }
  std::sort(files.begin(), files.end());
  return files;
}

}  // namespace

int main(int argc, char** argv) {
  std::size_t cuts = 200;
  std::size_t mutations = 0;
  std::string keep;
  std::vector<std::string> inputs;
  for (int i = 1; i < argc; ++i) {
    const std::string_view argument = argv[i];
    if (i + 1 < argc && argument == "--cuts") {
      cuts = std::strtoul(argv[++i], nullptr, 10);
    } else if (i + 1 < argc && argument == "--mutations") {
      mutations = std::strtoul(argv[++i], nullptr, 10);
    } else if (i + 1 < argc && argument == "--keep") {
      keep = argv[++i];
    } else {
      inputs.emplace_back(argument);
    }
  }

  std::vector<Bytes> corpus;
  for (const std::filesystem::path& path : FilesOf(inputs)) {
    std::ifstream file(path, std::ios::binary);
    corpus.emplace_back(std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>());
    RunCut(corpus.back(), cuts);
  }
  if (corpus.empty()) {
    std::printf("no inputs\n");
    return 1;
  }
  Mutator mutator(corpus);
  for (std::size_t i = 0; i < mutations; ++i) {
    const Bytes input = mutator.Next();
    if (!keep.empty()) {
      std::ofstream file(keep, std::ios::binary | std::ios::trunc);
      file.write(reinterpret_cast<const char*>(input.data()), static_cast<std::streamsize>(input.size()));
    }
    Run(input, input.size());
  }
  std::printf("%zu inputs, %zu made from them\n", corpus.size(), mutations);
  return 0;
}
