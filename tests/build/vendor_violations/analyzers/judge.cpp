// An AKD may be named here, and its FBUS.SYNCDIST (3496h) too.
#include <string>

namespace ecaudit {

constexpr unsigned kFaultNumbers = 0x2001;  // of the MKD
constexpr const char* kInfo[] = {"MKD, 4.6; PILZ, 5.3", "TI, AKD 4.2.1"};

struct Info {
  std::string needs, source, doc;
};
const Info kRule{.needs = "the status word of an AKD",
                 .source =
                     "manuals of Pilz "
                     "and Kollmorgen",
                 .doc = R"(
MKD: PTBASE
)"};

bool IsMkd(const std::string& family) {
  return family ==
         "kollmorgen"
         "-x";
}

std::string Text() {
  return "object 2001h of the drive, see FBUS.SYNCDIST";
}

}  // namespace ecaudit
