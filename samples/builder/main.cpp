// ecaudit_make_samples OUT_DIR: writes README.md, captures/ and captures/expected.json into OUT_DIR.
#include <cstdio>
#include <filesystem>
#include <fstream>

#include "samples/builder/catalogue.h"

namespace {

bool WriteFile(const std::filesystem::path& path, const char* data, std::size_t size) {
  std::ofstream file(path, std::ios::binary | std::ios::trunc);
  file.write(data, static_cast<std::streamsize>(size));
  file.close();
  if (!file) std::fprintf(stderr, "cannot write %s\n", path.c_str());
  return !file.fail();
}

bool WriteText(const std::filesystem::path& path, const std::string& text) {
  return WriteFile(path, text.data(), text.size());
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 2) {
    std::fprintf(stderr, "usage: ecaudit_make_samples OUT_DIR\n");
    return 2;
  }
  const std::filesystem::path root = argv[1];
  std::error_code problem;
  std::filesystem::create_directories(root / "captures", problem);
  if (problem) {
    std::fprintf(stderr, "cannot create %s: %s\n", (root / "captures").c_str(), problem.message().c_str());
    return 2;
  }
  const std::vector<ecaudit::samples::MadeSample> made = ecaudit::samples::MakeAll();
  bool good = WriteText(root / "README.md", ReadmeText(made));
  good = WriteText(root / "captures" / "expected.json", ExpectedJson(made)) && good;
  for (const ecaudit::samples::MadeSample& one : made) {
    const std::string bytes(one.sample.file.begin(), one.sample.file.end());
    good = WriteText(root / "captures" / one.file_name(), bytes) && good;
  }
  return good ? 0 : 1;
}
