// A case as one file: what comes out is what went in, whoever made the file, and an error leaves nothing behind.
#include "server/upload_validation/case_file.hpp"

#include <gtest/gtest.h>
#include <sys/stat.h>

#include <algorithm>
#include <cstdlib>
#include <ctime>
#include <fstream>
#include <set>
#include <string>

#include "common/volume/case.hpp"
#include "common/volume/case_scan.hpp"
#include "tests/support/content.hpp"
#include "tests/support/privileges.hpp"
#include "tests/support/process.hpp"
#include "tests/support/scenes/described_case.hpp"
#include "tests/support/size_limit.hpp"
#include "tests/support/temp_dir.hpp"
#include "tests/unit/upload_validation/zip_bytes.hpp"

namespace osteon {
namespace {

void put_bytes(const std::filesystem::path& file, const std::string& bytes) {
  std::ofstream(file, std::ios::binary) << bytes;
}

bool go_on(double) { return true; }

class CaseFileTest : public ::testing::Test {
 protected:
  CaseFileTest() {
    CaseScan scan = test::turned_scan();
    const auto bone = test::described_ball(test::full_description(scan));
    EXPECT_TRUE(bone) << bone.error().message;
    EXPECT_TRUE(bone->save(temp_ / "case", scan));
    hash_ = bone->hash();
    scan_hash_ = bone->info().scan->hash;
    std::filesystem::create_directory(temp_ / "out");
  }
  Result<CheckedCase> unpack(const std::filesystem::path& file, const UploadQuota& quota = case_file_quota(),
                             const KeepGoing& keep_going = go_on) const {
    return unpack_case_file(test::program("osteon-import"), file, temp_ / "out" / "case", quota, keep_going);
  }
  // Expects one sentence that names the file and why, and nothing in the folder of the target.
  void expect_refused(const std::filesystem::path& file, ErrorCode code, const std::string& why,
                      const UploadQuota& quota = case_file_quota()) const {
    const auto out = unpack(file, quota);
    ASSERT_FALSE(out) << why;
    const std::string& said = out.error().message;
    EXPECT_EQ(out.error().code, code) << said;
    EXPECT_NE(said.find(file.filename().string()), std::string::npos) << said;
    EXPECT_NE(said.find(why), std::string::npos) << said << "\nshould say " << why;
    EXPECT_NE(said.find(';'), std::string::npos) << said << "\nhas no remedy";
    EXPECT_EQ(said.find(".partial"), std::string::npos) << said;
    EXPECT_TRUE(std::ranges::none_of(said, [](char c) { return c >= 0 && c < ' '; })) << said;
    EXPECT_EQ(test::names_in(temp_ / "out"), std::set<std::string>{}) << said;
  }
  // The case with one more entry, or another one of a name.
  [[nodiscard]] std::filesystem::path archive(const test::Entry& more, const char* options = nullptr) const {
    const test::Bytes bytes = test::zip({{"case.json", test::content(temp_ / "case" / "case.json")},
                                         {"bone.vdb", test::content(temp_ / "case" / "bone.vdb")},
                                         more},
                                        options);
    put_bytes(temp_ / "made.osteon", {reinterpret_cast<const char*>(bytes.data()), bytes.size()});
    return temp_ / "made.osteon";
  }
  [[nodiscard]] std::filesystem::path packed() const {
    const auto done = pack_case_file(temp_ / "case", temp_ / "bone.osteon", true, go_on);
    EXPECT_TRUE(done) << done.error().message;
    return temp_ / "bone.osteon";
  }

  test::TempDir temp_;
  Digest hash_, scan_hash_;
};

TEST_F(CaseFileTest, WhatIsPackedComesOutAsTheSameCase) {
  double last = 0.0;
  int calls = 0;
  const auto rising = [&](double fraction) {
    EXPECT_GE(fraction, last);
    EXPECT_LE(fraction, 1.0);
    last = fraction;
    ++calls;
    return true;
  };
  const auto packed = pack_case_file(temp_ / "case", temp_ / "bone.osteon", false, rising);
  ASSERT_TRUE(packed) << packed.error().message;
  EXPECT_GT(calls, 1);
  last = 0.0;
  const auto out = unpack(temp_ / "bone.osteon", case_file_quota(), rising);
  ASSERT_TRUE(out) << out.error().message;
  EXPECT_EQ(last, 1.0);
  EXPECT_EQ(out->hash, hash_);
  EXPECT_EQ(test::names_in(temp_ / "out"), std::set<std::string>{"case"});
  const auto bone = Case::load(temp_ / "out" / "case");
  ASSERT_TRUE(bone) << bone.error().message;
  EXPECT_EQ(bone->hash(), hash_);
  const auto scan = load_scan(temp_ / "out" / "case", *bone);
  ASSERT_TRUE(scan) << scan.error().message;
  const auto described = describe_scan(*scan);
  ASSERT_TRUE(described);
  EXPECT_EQ(described->hash, scan_hash_);
  EXPECT_EQ(test::names_in(temp_ / "out" / "case"), (std::set<std::string>{"bone.vdb", "case.json", "scan.vdb"}));
}

TEST_F(CaseFileTest, ACaseWithoutItsScanIsOneToo) {
  std::filesystem::remove(temp_ / "case" / "scan.vdb");
  const auto out = unpack(packed());
  ASSERT_TRUE(out) << out.error().message;
  EXPECT_EQ(out->hash, hash_);
}

TEST_F(CaseFileTest, TheSameFilesAreTheSameBytes) {
  const std::string first = test::content(packed());
  using namespace std::chrono_literals;
  for (const char* file : {"case.json", "bone.vdb", "scan.vdb"}) {
    const std::filesystem::path path = temp_ / "case" / file;
    std::filesystem::last_write_time(path, std::filesystem::last_write_time(path) - 20000h);
    std::filesystem::permissions(path, std::filesystem::perms::owner_read);
  }
  put_bytes(temp_ / "case" / "notes.txt", "this is no part of a case");
  const char* zone = std::getenv("TZ");
  const std::string before = zone != nullptr ? zone : "";
  for (const char* other : {"Pacific/Kiritimati", "Pacific/Pago_Pago"}) {  // a day apart
    ::setenv("TZ", other, 1);
    ::tzset();
    EXPECT_EQ(test::content(packed()), first) << other;
  }
  zone != nullptr ? ::setenv("TZ", before.c_str(), 1) : ::unsetenv("TZ");
  ::tzset();
  EXPECT_EQ(first.substr(30, 9), "case.json");  // by which deploy/desktop/osteon-case.xml knows the file
}

TEST_F(CaseFileTest, FilesOfAttackersAreRefused) {
  const std::vector<std::pair<const char*, test::Entry>> evil{
      {"absolute", {"/tmp/scan.vdb", "x"}},
      {"upwards", {"../scan.vdb", "x"}},
      {"upwards from a folder", {"a/../../scan.vdb", "x"}},
      {"a symbolic link", {"scan.vdb", "", "/etc/passwd", false, test::kLinkEntry}},
      {"another file", {"run.sh", "x"}},
      {"twice", {"case.json", "{}"}},
      {"in another folder", {"b/scan.vdb", "x"}},
  };
  for (const auto& [what, entry] : evil) {
    SCOPED_TRACE(what);
    expect_refused(archive(entry), ErrorCode::invalid_input, "has an entry that ");
  }
  expect_refused(archive({"scan.vdb", "x"}, "zip:encryption=traditional"), ErrorCode::invalid_input, "encrypted");
  std::vector<test::Entry> many;
  for (int i = 0; i < 20; ++i) many.push_back({"d" + std::to_string(i) + "/", "", "", false, test::kFolderEntry});
  const test::Bytes folders = test::zip(many);
  put_bytes(temp_ / "many.osteon", {reinterpret_cast<const char*>(folders.data()), folders.size()});
  expect_refused(temp_ / "many.osteon", ErrorCode::exhausted, "entries");
}

TEST_F(CaseFileTest, BombsStopAtTheLimits) {
  const std::string zeros(32 << 20, '\0');
  expect_refused(archive({"scan.vdb", zeros}), ErrorCode::exhausted, "times its size");
  UploadQuota small = case_file_quota();
  small.ratio = 1e9;
  small.unpacked_bytes = 4 << 20;
  expect_refused(archive({"scan.vdb", zeros}), ErrorCode::exhausted, "bytes that a case may have", small);
  small.archive_bytes = 100;
  expect_refused(packed(), ErrorCode::exhausted, "bytes that an archive may have", small);
}

TEST_F(CaseFileTest, WhatIsNoSoundCaseIsRefused) {
  const std::string sound = test::content(packed());
  const auto refused = [&](const char* name, const std::string& bytes, const std::string& why) {
    put_bytes(temp_ / name, bytes);
    expect_refused(temp_ / name, ErrorCode::invalid_input, why);
  };
  refused("picture.osteon", std::string("\xff\xd8\xff\xe0\0\x10JFIF", 10) + std::string(5000, 'x'), "zip archive");
  refused("empty.osteon", "", "zip archive");
  refused("truncated.osteon", sound.substr(0, sound.size() / 2), "truncated.osteon");
  std::string changed = sound;
  changed[changed.find("bone.vdb") + 200] ^= 1;
  refused("changed.osteon", changed, "changed.osteon");
  const std::string json = test::content(temp_ / "case" / "case.json"),
                    vdb = test::content(temp_ / "case" / "bone.vdb");
  const auto zipped = [](const std::vector<test::Entry>& entries) {
    const test::Bytes bytes = test::zip(entries);
    return std::string(reinterpret_cast<const char*>(bytes.data()), bytes.size());
  };
  refused("nameless.osteon", zipped({{"bone.vdb", vdb}}), "has no case.json");
  refused("boneless.osteon", zipped({{"case.json", json}}), "has no bone.vdb");
  std::string retitled = json;
  const std::size_t title = retitled.find("\"title\": \"") + 10;
  retitled[title] = retitled[title] == 'x' ? 'y' : 'x';
  refused("retitled.osteon", zipped({{"case.json", retitled}, {"bone.vdb", vdb}}), "not sound");
  CaseScan other = test::turned_scan();
  other.hu[5] = static_cast<std::int16_t>(other.hu[5] + 1);
  ASSERT_TRUE(save_scan(temp_ / "other.vdb", other));
  refused("rescanned.osteon",
          zipped({{"case.json", json}, {"bone.vdb", vdb}, {"scan.vdb", test::content(temp_ / "other.vdb")}}),
          "not sound");
}

TEST_F(CaseFileTest, FoldersMadeForACaseThatIsRefusedGo) {
  put_bytes(temp_ / "empty.osteon", "");
  const auto into = [&](const std::filesystem::path& file) {
    return unpack_case_file(test::program("osteon-import"), file, temp_ / "out" / "new" / "deep" / "case",
                            case_file_quota(), go_on);
  };
  ASSERT_FALSE(into(temp_ / "empty.osteon"));
  EXPECT_EQ(test::names_in(temp_ / "out"), std::set<std::string>{});
  const auto out = into(packed());
  ASSERT_TRUE(out) << out.error().message;
  EXPECT_EQ(test::names_in(temp_ / "out" / "new" / "deep"), std::set<std::string>{"case"});
}

TEST_F(CaseFileTest, OnlyPlainFilesAreRead) {
  expect_refused(temp_ / "case", ErrorCode::invalid_input, "is a folder");
  expect_refused(temp_ / "away.osteon", ErrorCode::not_found, "is not there");
  ASSERT_EQ(::mkfifo((temp_ / "pipe.osteon").c_str(), 0600), 0);
  expect_refused(temp_ / "pipe.osteon", ErrorCode::invalid_input, "is not a plain file");
}

TEST_F(CaseFileTest, WhoCancelsFindsNothing) {
  const std::filesystem::path file = packed();
  const auto names = test::names_in(temp_.path());
  for (const double until : {0.0, 0.05, 0.5, 0.995}) {
    const auto stops = [until](double fraction) { return fraction < until; };
    const auto out = unpack(file, case_file_quota(), stops);
    ASSERT_FALSE(out) << until;
    EXPECT_EQ(out.error().code, ErrorCode::cancelled) << out.error().message;
    EXPECT_EQ(test::names_in(temp_ / "out"), std::set<std::string>{});
    const auto again = pack_case_file(temp_ / "case", temp_ / "other.osteon", false, stops);
    ASSERT_FALSE(again) << until;
    EXPECT_EQ(again.error().code, ErrorCode::cancelled) << again.error().message;
    EXPECT_EQ(test::names_in(temp_.path()), names);
  }
}

TEST_F(CaseFileTest, AFullDiskLeavesNothing) {
  const std::filesystem::path file = packed();
  const auto names = test::names_in(temp_.path());
  const test::SizeLimit small(1000);
  const auto out = unpack(file);
  ASSERT_FALSE(out);
  EXPECT_EQ(out.error().code, ErrorCode::internal);
  EXPECT_NE(out.error().message.find("make room"), std::string::npos) << out.error().message;
  EXPECT_EQ(test::names_in(temp_ / "out"), std::set<std::string>{});
  const auto again = pack_case_file(temp_ / "case", temp_ / "bone.osteon", true, go_on);
  ASSERT_FALSE(again);
  EXPECT_EQ(again.error().code, ErrorCode::internal);
  EXPECT_NE(again.error().message.find("make room"), std::string::npos) << again.error().message;
  EXPECT_EQ(test::names_in(temp_.path()), names);
}

TEST_F(CaseFileTest, AFolderWhereNobodyMayWriteIsSaid) {
  const std::filesystem::path file = packed(), closed = temp_ / "closed";
  std::filesystem::create_directory(closed);
  std::filesystem::permissions(closed, std::filesystem::perms::owner_read | std::filesystem::perms::owner_exec);
  {
    const test::WithoutPrivileges plain;
    const auto out = unpack_case_file(test::program("osteon-import"), file, closed / "case", case_file_quota(), go_on);
    const auto again = pack_case_file(temp_ / "case", closed / "bone.osteon", false, go_on);
    ASSERT_FALSE(out);
    ASSERT_FALSE(again);
    for (const std::string& said : {out.error().message, again.error().message}) {
      EXPECT_NE(said.find(closed.string()), std::string::npos) << said;
      EXPECT_NE(said.find("choose"), std::string::npos) << said;
      EXPECT_EQ(said.find(".partial"), std::string::npos) << said;
    }
  }
  EXPECT_EQ(test::names_in(closed), std::set<std::string>{});
}

TEST_F(CaseFileTest, NothingIsWrittenOverUnasked) {
  const std::filesystem::path file = packed();
  put_bytes(temp_ / "letter.osteon", "dear");
  const auto kept = pack_case_file(temp_ / "case", temp_ / "letter.osteon", false, go_on);
  ASSERT_FALSE(kept);
  EXPECT_EQ(kept.error().code, ErrorCode::exists);
  EXPECT_EQ(test::content(temp_ / "letter.osteon"), "dear");
  EXPECT_TRUE(pack_case_file(temp_ / "case", temp_ / "letter.osteon", true, go_on));
  EXPECT_EQ(test::content(temp_ / "letter.osteon"), test::content(file));
  std::filesystem::create_directory(temp_ / "out" / "case");
  const auto out = unpack(file);
  ASSERT_FALSE(out);
  EXPECT_EQ(out.error().code, ErrorCode::exists);
  EXPECT_EQ(test::names_in(temp_ / "out" / "case"), std::set<std::string>{});
}

TEST_F(CaseFileTest, ADamagedCaseIsNotPacked) {
  std::string vdb = test::content(temp_ / "case" / "bone.vdb");
  vdb[vdb.size() / 2] ^= 4;
  put_bytes(temp_ / "case" / "bone.vdb", vdb);
  EXPECT_FALSE(pack_case_file(temp_ / "case", temp_ / "bone.osteon", false, go_on));
  EXPECT_FALSE(std::filesystem::exists(temp_ / "bone.osteon"));
}

TEST_F(CaseFileTest, ALibraryKnowsAFileByItsContent) {
  const std::filesystem::path file = packed();
  const auto first = folder_of_case_file(temp_ / "library", file, go_on);
  ASSERT_TRUE(first);
  EXPECT_EQ(first->parent_path(), temp_ / "library");
  std::filesystem::rename(file, temp_ / "moved.osteon");
  EXPECT_EQ(*folder_of_case_file(temp_ / "library", temp_ / "moved.osteon", go_on), *first);
  put_bytes(temp_ / "abc", "abc");  // the example of FIPS 180-2
  EXPECT_EQ(folder_of_case_file({}, temp_ / "abc", go_on)->string(),
            "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad");
}

// The commands, as their users see them.
TEST_F(CaseFileTest, TheCommandsPackAndUnpack) {
  const auto import = [](const std::vector<std::string>& arguments) {
    return test::run(test::program("osteon-import"), arguments);
  };
  const std::string file = temp_ / "bone.osteon";
  const auto made = import({"pack", temp_ / "case", file});
  ASSERT_EQ(made.exit_code, 0) << made.err;
  EXPECT_TRUE(made.out.starts_with("file       " + file + ", ")) << made.out;
  const auto out = import({"unpack", file, "--out", temp_ / "out" / "case"});
  ASSERT_EQ(out.exit_code, 0) << out.err;
  EXPECT_NE(out.out.find(to_hex(hash_)), std::string::npos) << out.out;
  // The second time the folder is there.
  std::string first_line;
  for (int time = 0; time < 2; ++time) {
    const auto again = import({"unpack", file, "--into", temp_ / "library"});
    ASSERT_EQ(again.exit_code, 0) << again.err;
    const std::string line = again.out.substr(0, again.out.find('\n'));
    EXPECT_TRUE(line.starts_with("folder     " + (temp_ / "library").string() + "/")) << line;
    EXPECT_TRUE(time == 0 || line == first_line);
    first_line = line;
  }
  EXPECT_EQ(test::names_in(temp_ / "library").size(), 1u);

  const auto refused = [&](const std::vector<std::string>& arguments, const std::string& why) {
    const auto said = import(arguments);
    EXPECT_EQ(said.exit_code, 1);
    EXPECT_EQ(said.out, "");
    EXPECT_EQ(std::ranges::count(said.err, '\n'), 1) << said.err;
    EXPECT_NE(said.err.find(why), std::string::npos) << said.err;
  };
  refused({"pack", temp_ / "case", file}, "is already there");
  refused({"pack", temp_ / "case", temp_ / "bone.rar"}, "such as skull.osteon");
  refused({"pack", temp_ / "out", temp_ / "b.osteon"}, "case.json");
  refused({"unpack", file}, "--out");
  // Whoever gives the file instead of a folder or a scan is told how to make the folder.
  const std::vector<std::vector<std::string>> instead{
      {"info", file}, {"ct", file, "--out", temp_ / "ct"}, {"series", file}, {"report", file}};
  for (const auto& command : instead) refused(command, "osteon-import unpack " + file + " --out FOLDER");
  refused({"unpack", file, "--out", temp_ / "x", "--into", temp_ / "y"}, "--into");
}

}  // namespace
}  // namespace osteon
