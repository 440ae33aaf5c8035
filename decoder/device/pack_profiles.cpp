// Run while the program is built: PROFILE.json TARGET writes TARGET.packed and TARGET.head. Silent; the exit status
// tells.
#include <fstream>
#include <iterator>
#include <string>

#include "decoder/base/packed_json.h"
#include "decoder/device/profile_reader.h"

namespace {

bool Write(const std::string& path, const std::string& packed) {
  std::ofstream out(path, std::ios::binary);
  out << packed;
  out.close();
  return !packed.empty() && out.good();
}

}  // namespace

int main(int count, char** arguments) {
  if (count != 3) return 2;
  std::ifstream file(arguments[1], std::ios::binary);
  const std::string text(std::istreambuf_iterator<char>(file), {});
  const std::string target = arguments[2];
  const bool written = Write(target + ".packed", ecaudit::PackJson(text)) &&
                       Write(target + ".head", ecaudit::PackJson(text, ecaudit::device::kHeadKeys));
  return written ? 0 : 1;
}
