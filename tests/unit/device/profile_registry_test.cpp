#include "decoder/device/profile_registry.h"

#include <filesystem>
#include <fstream>
#include <string>
#include <thread>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "decoder/base/cbor.h"
#include "decoder/device/embedded_files.h"
#include "decoder/device/profile_reader.h"

namespace ecaudit::device {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

std::vector<std::string> Ids(const std::vector<const DeviceDescription*>& profiles) {
  std::vector<std::string> ids;
  for (const DeviceDescription* profile : profiles) ids.push_back(profile->id);
  return ids;
}

TEST(ProfileRegistry, BuiltinProfilesAreEmbeddedAsTheyAreWritten) {
  for (const std::string& name : BuiltinProfileNames()) {
    const std::string cbor = CborOf(EmbeddedProfileText(name));
    EXPECT_FALSE(cbor.empty()) << name;
    EXPECT_TRUE(EmbeddedProfileCbor(name) == cbor) << name;
    EXPECT_TRUE(EmbeddedHeadCbor(name) == CborOf(EmbeddedProfileText(name), kHeadKeys)) << name;
  }
  EXPECT_TRUE(EmbeddedProfileCbor("nobody").empty());
}

TEST(ProfileRegistry, ObjectsOfAProfileAreKnownWithoutParsing) {
  const auto row_of = [](const DeviceDescription& profile, std::uint16_t index) {
    const DictionaryObject* row = profile.dictionary ? profile.dictionary->FindIndex(index) : nullptr;
    return row == nullptr && profile.drive ? FindObjectHead(profile.drive->objects, index) : row;
  };
  const DeviceDescription& generic = *BuiltinProfile("generic");
  std::size_t inherited = 0, own = 0;
  for (const std::string& name : BuiltinProfileNames()) {
    const DeviceDescription& profile = *BuiltinProfile(name);
    for (unsigned index = 0; index <= 0xFFFF; ++index) {
      const auto i = static_cast<std::uint16_t>(index);
      const DictionaryObject* row = row_of(profile, i);
      if (BuiltinProfileLists(name, i)) {
        ++own;
        EXPECT_NE(row, nullptr) << name << " " << index;
      } else if (row != nullptr) {  // all that it says of the object the standard says
        ++inherited;
        const DictionaryObject* standard = row_of(generic, i);
        ASSERT_NE(standard, nullptr) << name << " " << index;
        EXPECT_EQ(row->name, standard->name) << name << " " << index;
        EXPECT_EQ(row->source, standard->source) << name << " " << index;
      }
    }
  }
  EXPECT_GT(own, 500U);
  EXPECT_GT(inherited, 100U);
  EXPECT_TRUE(BuiltinProfileLists("generic", 0x6041));
  EXPECT_FALSE(BuiltinProfileLists("kollmorgen-akd-2011", 0x3470));
  EXPECT_FALSE(BuiltinProfileLists("nobody", 0x1000));
}

/// A folder of its own for one test.
class Folder {
 public:
  Folder() {
    const std::string name = ::testing::UnitTest::GetInstance()->current_test_info()->name();
    path_ = std::filesystem::path(::testing::TempDir()) / ("ecaudit_profiles_" + name);
    std::filesystem::remove_all(path_);
    std::filesystem::create_directories(path_);
  }
  ~Folder() { std::filesystem::remove_all(path_); }
  Folder(const Folder&) = delete;
  Folder& operator=(const Folder&) = delete;

  std::string Write(const std::string& name, const std::string& text) const {
    const std::string file = (path_ / name).string();
    std::ofstream(file, std::ios::binary) << text;
    return file;
  }
  std::string WriteProfile(const std::string& id, const std::string& rest) const {
    return Write(id + ".json", R"({"schema": "ecaudit.profile/1", "id": ")" + id +
                                   R"(", "title": "T", "document": "D")" + rest + "}");
  }
  [[nodiscard]] std::string path() const { return path_.string(); }

 private:
  std::filesystem::path path_;
};

TEST(ProfileRegistry, ProfilesOfTheContractAreBuiltIn) {
  EXPECT_THAT(BuiltinProfileNames(), ElementsAre("generic", "kollmorgen-akd-2010", "kollmorgen-akd-2011",
                                                 "kollmorgen-mkd-c", "kollmorgen-mkd-n", "pilz-pmcprotego-d"));
}

TEST(ProfileRegistry, EveryBuiltInProfileParses) {
  for (const std::string& name : BuiltinProfileNames()) {
    const DeviceDescription* profile = BuiltinProfile(name);
    ASSERT_NE(profile, nullptr) << name;
    EXPECT_EQ(profile->id, name);
    EXPECT_NE(profile->title, "");
    EXPECT_NE(profile->document, "");
    EXPECT_EQ(profile->extends, name == "generic" ? "" : "generic");
    EXPECT_EQ(BuiltinProfile(name), profile);  // parsed once
  }
}

TEST(ProfileRegistry, ProfilesOfAMakerAreFoundWithoutParsing) {
  for (const std::string& name : BuiltinProfileNames()) {
    const auto& vendor = BuiltinProfile(name)->match.vendor_id;
    if (!vendor) continue;
    std::vector<std::string> wanted;
    for (const std::string& other : BuiltinProfileNames()) {
      if (BuiltinProfile(other)->match.vendor_id == vendor) wanted.push_back(other);
    }
    EXPECT_EQ(BuiltinProfilesOf(*vendor), wanted) << name;
  }
  EXPECT_TRUE(BuiltinProfilesOf(0xFFFF'FFFF).empty());
}

TEST(ProfileRegistry, UnknownNamesGiveNothing) {
  EXPECT_EQ(BuiltinProfile("acme"), nullptr);
  EXPECT_EQ(BuiltinProfile(""), nullptr);
  EXPECT_EQ(BuiltinProfile("../profiles/generic"), nullptr);
  EXPECT_EQ(BuiltinProfileText("../profiles/generic"), "");
}

TEST(ProfileRegistry, ManyThreadsSeeOneProfile) {
  std::vector<const DeviceDescription*> seen(4);
  std::vector<std::thread> threads;
  for (auto& result : seen) threads.emplace_back([&result] { result = BuiltinProfile("kollmorgen-mkd-n"); });
  for (std::thread& thread : threads) thread.join();
  for (const DeviceDescription* profile : seen) EXPECT_EQ(profile, BuiltinProfile("kollmorgen-mkd-n"));
}

TEST(ProfileRegistry, IdentityGivesTheNewestEditionFirst) {
  EXPECT_THAT(Ids(MatchIdentity(0x6A, 0x00414B44, 2)), ElementsAre("kollmorgen-akd-2011", "kollmorgen-akd-2010"));
  EXPECT_THAT(Ids(MatchIdentity(0x6A, 0x02, 0x00020000)), ElementsAre("kollmorgen-mkd-c"));
}

TEST(ProfileRegistry, WhatNoManualDocumentsIsNotMatched) {
  EXPECT_THAT(MatchIdentity(0x6A, 0x12345678, 0), IsEmpty());
  EXPECT_THAT(MatchIdentity(0x02, 0x00414B44, 2), IsEmpty());
  EXPECT_THAT(MatchIdentity(0, 0, 0), IsEmpty());
  EXPECT_FALSE(BuiltinProfile("pilz-pmcprotego-d")->match.vendor_id);
  EXPECT_NE(BuiltinProfile("pilz-pmcprotego-d")->match.note, "");
  EXPECT_THAT(BuiltinProfile("kollmorgen-mkd-n")->match.product_codes, IsEmpty());
}

TEST(ProfileRegistry, MkdIsFoundByItsModelType) {
  const ProfileRegistry registry;
  EXPECT_THAT(Ids(registry.MatchModel("MKD-N00106")), ElementsAre("kollmorgen-mkd-n"));
  EXPECT_THAT(Ids(registry.MatchModel("MKD-C")), ElementsAre("kollmorgen-mkd-c"));
  EXPECT_THAT(registry.MatchModel("MK"), IsEmpty());
  EXPECT_THAT(registry.MatchModel(""), IsEmpty());
}

TEST(ProfileRegistry, AFileMayExtendABuiltInProfile) {
  const Folder folder;
  const auto profile = LoadProfileFile(folder.WriteProfile("mine", R"(, "extends": "kollmorgen-akd-2011")"));
  ASSERT_TRUE(profile) << profile.error().message;
  EXPECT_EQ(profile->al.status_codes.size(), 3U);
}

TEST(ProfileRegistry, FileErrorsNameTheFile) {
  const Folder folder;
  const std::string missing = folder.path() + "/none.json";
  EXPECT_EQ(LoadProfileFile(missing).error().message, missing + ": no such file");
  EXPECT_EQ(LoadProfileFile(folder.path()).error().message, folder.path() + ": not a file");
  const std::string bad = folder.Write("bad.json", "{");
  EXPECT_THAT(LoadProfileFile(bad).error().message, HasSubstr(bad + ": parse error at line 1"));
}

TEST(ProfileRegistry, FilesOfAFolderMayExtendEachOtherInAnyOrder) {
  const Folder folder;
  folder.WriteProfile("a", R"(, "extends": "b")");
  folder.WriteProfile("b", R"(, "extends": "generic", "match": {"vendor_id": 9, "product_codes": [8], "source": "s"})");
  folder.Write("readme.txt", "not a profile");
  ProfileRegistry registry;
  const auto added = registry.AddDirectory(folder.path());
  ASSERT_TRUE(added) << added.error().message;
  EXPECT_EQ(*added, 2U);
  ASSERT_NE(registry.Find("a"), nullptr);
  EXPECT_EQ(registry.Find("a")->al.transitions.size(), 25U);
  EXPECT_THAT(Ids(registry.MatchIdentity(9, 8, 1)), ElementsAre("b"));
  EXPECT_EQ(registry.Names().size(), BuiltinProfileNames().size() + 2);
}

TEST(ProfileRegistry, AUserProfileHidesTheBuiltInOneAndMayExtendIt) {
  const Folder folder;
  folder.WriteProfile("generic", R"(, "extends": "generic", "note": "mine")");
  ProfileRegistry registry;
  const auto added = registry.AddDirectory(folder.path());
  ASSERT_TRUE(added) << added.error().message;
  EXPECT_EQ(registry.Find("generic")->note, "mine");
  EXPECT_EQ(registry.Find("generic")->al.transitions.size(), 25U);
  EXPECT_NE(BuiltinProfile("generic")->note, "mine");
}

TEST(ProfileRegistry, AUserProfileHidesTheIdentityOfTheBuiltInOne) {
  const Folder folder;
  folder.WriteProfile("kollmorgen-mkd-c", R"(, "extends": "kollmorgen-mkd-c")");
  ProfileRegistry registry;
  ASSERT_TRUE(registry.AddDirectory(folder.path()));
  EXPECT_THAT(registry.MatchIdentity(0x6A, 0x02, 0x00020000), IsEmpty());
  EXPECT_THAT(Ids(MatchIdentity(0x6A, 0x02, 0x00020000)), ElementsAre("kollmorgen-mkd-c"));
}

TEST(ProfileRegistry, WhatIsAddedComesBeforeWhatIsBuiltIn) {
  const Folder folder;
  folder.WriteProfile("mine", R"(, "edition": "1999", "match": {"vendor_id": "0x6A", "product_codes": ["0x00414B44"], )"
                              R"("source": "s"})");
  folder.Write("copy.json", BuiltinProfileText("kollmorgen-mkd-c"));
  folder.Write(".settings.json", "{}");
  ProfileRegistry registry;
  EXPECT_EQ(registry.AddPath(folder.path()), std::nullopt);
  EXPECT_THAT(Ids(registry.MatchIdentity(0x6A, 0x00414B44, 2)),
              ElementsAre("mine", "kollmorgen-akd-2011", "kollmorgen-akd-2010"));
  EXPECT_EQ(registry.own().size(), 1U) << "a copy of a built-in profile is none of its own";
  EXPECT_THAT(registry.own().at("mine").path, HasSubstr("mine"));
  EXPECT_NE(registry.AddPath(folder.path() + "/none.json"), std::nullopt);
}

TEST(ProfileRegistry, CyclesAndSharedIdsAreErrors) {
  const Folder folder;
  folder.WriteProfile("a", R"(, "extends": "b")");
  folder.WriteProfile("b", R"(, "extends": "a")");
  ProfileRegistry registry;
  const auto cycle = registry.AddDirectory(folder.path());
  ASSERT_FALSE(cycle);
  EXPECT_THAT(cycle.error().message, HasSubstr("cycle"));
  EXPECT_EQ(registry.Find("a"), nullptr);

  folder.WriteProfile("b", "");
  folder.Write("c.json", R"({"schema": "ecaudit.profile/1", "id": "b", "title": "T", "document": "D"})");
  const auto shared = registry.AddDirectory(folder.path());
  ASSERT_FALSE(shared);
  EXPECT_THAT(shared.error().message, HasSubstr("id \"b\" is also that of"));
}

TEST(ProfileRegistry, AFolderThatIsNotThereIsAnError) {
  ProfileRegistry registry;
  EXPECT_FALSE(registry.AddDirectory("/no/such/folder"));
}

}  // namespace
}  // namespace ecaudit::device
