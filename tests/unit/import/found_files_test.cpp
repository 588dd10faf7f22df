// Tests how inputs are searched and unpacked, and what happens when a reader process dies.
#include "server/import/found_files.hpp"

#include <archive.h>
#include <archive_entry.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cstdlib>
#include <fstream>

#include "server/import/archive_files.hpp"
#include "server/import/dicom_header.hpp"
#include "server/import/isolated_reader.hpp"
#include "server/import/skipped_files.hpp"
#include "tests/support/temp_dir.hpp"
#include "tests/unit/import/fixtures.hpp"

namespace osteon::import {
namespace {

namespace fs = std::filesystem;

Content content_of_text(const std::string& text) {
  return content_of({reinterpret_cast<const unsigned char*>(text.data()), std::min(text.size(), kHeadBytes)});
}

TEST(SkippedFiles, OfTwoSearchesAreAddedUp) {
  SkippedFiles one, other;
  for (const char* name : {"a", "b"}) one.add(FileKind::damaged, name);
  other.add(FileKind::damaged, "c");
  other.add(FileKind::damaged, "d");
  other.add(FileKind::dose_report, "e");
  one.add(other);
  EXPECT_EQ(one.count(FileKind::damaged), 4);
  EXPECT_EQ(one.text(), "1 dose report, 4 damaged files (a, b, c, ...)");
}

TEST(ContentOf, RawNumbersAreNotDicom) {
  EXPECT_EQ(content_of_text(""), Content::empty);
  EXPECT_EQ(content_of_text("This is a letter, not a scan.\n"), Content::other);
  EXPECT_EQ(content_of_text(std::string(8192, '\0')), Content::other);
  EXPECT_EQ(content_of_text("PK\3\4 and more"), Content::archive);
  // Voxels whose bytes look like the head of one element, or of two.
  const std::string one("\10\0\5\0\4\0\0\0abcd", 12);
  EXPECT_EQ(content_of_text(one + std::string(8180, '\1')), Content::other);
  EXPECT_EQ(content_of_text(one + std::string("\10\0\10\0\4\0\0\0abcd", 12) + std::string(8168, '\1')), Content::other);
  std::string volume;
  unsigned state = 1;
  for (int i = 0; i < 200'000; ++i) {
    state = state * 1664525u + 1013904223u;
    volume += static_cast<char>(state >> 24);
  }
  for (std::size_t at = 0; at + kHeadBytes < volume.size(); ++at)
    EXPECT_NE(content_of_text(volume.substr(at, 64)), Content::dicom);
}

TEST(KindOf, NamesObjectsByTheirClass) {
  const std::string storage = "1.2.840.10008.5.1.4.1.1.";
  EXPECT_EQ(kind_of("1.2.840.10008.1.3.10", "", ""), FileKind::index);
  EXPECT_EQ(kind_of(storage + "88.67", "SR", ""), FileKind::dose_report);
  EXPECT_EQ(kind_of(storage + "88.33", "SR", ""), FileKind::report);
  EXPECT_EQ(kind_of(storage + "7", "CT", ""), FileKind::secondary_capture);
  EXPECT_EQ(kind_of(storage + "7.4", "OT", ""), FileKind::secondary_capture);
  EXPECT_EQ(kind_of(storage + "7", "CT", "DERIVED\\SECONDARY\\DOSE_INFO"), FileKind::dose_report);
  EXPECT_EQ(kind_of(storage + "66.4", "SEG", ""), FileKind::segmentation);
  EXPECT_EQ(kind_of(storage + "481.3", "RTSTRUCT", ""), FileKind::radiotherapy);
  EXPECT_EQ(kind_of(storage + "4", "MR", ""), FileKind::other_modality);
  EXPECT_EQ(kind_of("", "", ""), FileKind::other_modality);
  EXPECT_EQ(kind_of(storage + "2", "CT", "ORIGINAL\\PRIMARY\\LOCALIZER\\CT_SOM5 TOP"), FileKind::localizer);
  EXPECT_EQ(kind_of(storage + "2", "CT", "DERIVED\\SECONDARY\\MPR"), FileKind::ct_slice);
  EXPECT_EQ(kind_of(storage + "2", "", "ORIGINAL\\PRIMARY\\AXIAL"), FileKind::ct_slice);
  EXPECT_EQ(kind_of("", "CT", ""), FileKind::ct_slice);
}

TEST(ShownText, HasNoControlsAndIsCut) {
  EXPECT_EQ(shown_text("HEAD\n\x1b[31m1.0\t", 64), "HEAD??[31m1.0?");
  EXPECT_EQ(shown_text("Sch\xe4"
                       "del",
                       64, true),
            "Schädel");
  EXPECT_EQ(shown_text("Sch\xe4"
                       "del",
                       64),
            "Sch?del");
  EXPECT_EQ(shown_text("Schädel \xc2\x9b \xe2\x80\xae", 64), "Schädel ? ?");
  EXPECT_EQ(shown_text(std::string(100, 'a'), 64), std::string(64, 'a') + "...");
}

TEST(FindFiles, TakesFilesOfAllSubfoldersOnce) {
  const test::TempDir folder;
  fs::create_directories(folder / "a" / "b");
  std::ofstream(folder / "a" / "b" / "file") << "x";
  std::ofstream(folder / "file") << "x";
  fs::create_directory_symlink(folder.path(), folder / "a" / "loop");
  fs::create_symlink("nowhere", folder / "dangling");
  fs::create_symlink(folder / "file", folder / "linked");
  ASSERT_EQ(::mkfifo((folder / "pipe").c_str(), 0600), 0);
  const auto found = find_files(folder.path(), kMostLevels, keep_going);
  ASSERT_TRUE(found);
  ASSERT_EQ(found->files.size(), 3u);
  EXPECT_EQ(found->files[0].name, "a/b/file");
  EXPECT_EQ(found->shown(0), (folder / "a/b/file").string());
  EXPECT_EQ(found->skipped.count(FileKind::link), 2);
  EXPECT_EQ(found->skipped.count(FileKind::special), 1);
}

TEST(FindFiles, GoesNoDeeperThanItsLastLevel) {
  const test::TempDir folder;
  fs::path deep = folder.path();
  for (int i = 0; i < 60; ++i) deep /= "d";
  fs::create_directories(deep);
  const auto found = find_files(folder.path(), kMostLevels, keep_going);
  ASSERT_TRUE(found);
  EXPECT_EQ(found->skipped.count(FileKind::too_deep), 1);
}

class Unpacking : public ::testing::Test {
 protected:
  void SetUp() override {
    fs::create_directories(folder_ / "cd" / "DICOM");
    fs::create_directories(folder_ / "out" / "into");
    for (const char* name : {"1", "2", "3"})
      write_object(folder_ / "cd" / "DICOM" / name, "1.2.840.10008.5.1.4.1.1.4", "MR");
    std::ofstream(folder_ / "cd" / "README.txt") << "Open with our viewer\n";
    ASSERT_NO_FATAL_FAILURE(write_archive(folder_ / "cd", folder_ / "cd.zip", "zip"));
  }
  [[nodiscard]] Result<FoundFiles> unpack(const std::string& name, const ArchiveLimits& limits = {}) const {
    return unpack_archive(folder_ / name, folder_ / "out" / "into", limits, keep_going);
  }
  void expect_refused(const Result<FoundFiles>& found, const std::string& why) const {
    ASSERT_FALSE(found);
    expect_one_sentence(found.error(), why);
    EXPECT_NE(found.error().message.find(';'), std::string::npos) << found.error().message;
  }
  test::TempDir folder_;
};

TEST_F(Unpacking, NumbersTheFilesThatMayBeDicom) {
  const auto found = unpack("cd.zip");
  ASSERT_TRUE(found) << found.error().message;
  ASSERT_EQ(found->files.size(), 3u);
  EXPECT_EQ(found->shown(0), (folder_ / "cd.zip").string() + ": DICOM/1");
  EXPECT_EQ(found->files[0].path, folder_ / "out" / "into" / "0");
  EXPECT_EQ(found->skipped.text(), "1 file that is not DICOM");
  EXPECT_EQ(files_of(folder_ / "out" / "into").size(), 3u);
}

TEST_F(Unpacking, EndsAtItsLimits) {
  expect_refused(unpack("cd.zip", {.entries = 4}), "more than 4 entries");
  expect_refused(unpack("cd.zip", {.bytes = 700}), "TMPDIR");
}

TEST_F(Unpacking, LeavesTheDiskItsSpareRoom) {
  expect_refused(unpack("cd.zip", {.spare_bytes = std::uint64_t{1} << 62}), "more DICOM than the disk");
}

TEST_F(Unpacking, AnEncryptedZipIsRefused) {
  ASSERT_NO_FATAL_FAILURE(write_archive(folder_ / "cd", folder_ / "secret.zip", "secret"));
  expect_refused(unpack("secret.zip"), "is encrypted");
}

TEST_F(Unpacking, NamesAndLinksDoNotLeaveTheFolder) {
  archive* a = archive_write_new();
  archive_write_set_format_zip(a);
  ASSERT_EQ(archive_write_open_filename(a, (folder_ / "evil.zip").c_str()), ARCHIVE_OK);
  const auto add = [&](const char* name, const char* link) {
    archive_entry* entry = archive_entry_new();
    archive_entry_set_pathname(entry, name);
    archive_entry_set_perm(entry, 0644);
    std::string content;
    if (link != nullptr) {
      archive_entry_set_filetype(entry, AE_IFLNK);
      archive_entry_set_symlink(entry, link);
    } else {
      archive_entry_set_filetype(entry, AE_IFREG);
      std::ifstream in(folder_ / "cd" / "DICOM" / "1", std::ios::binary);
      content.assign(std::istreambuf_iterator<char>(in), {});
      archive_entry_set_size(entry, static_cast<la_int64_t>(content.size()));
    }
    ASSERT_EQ(archive_write_header(a, entry), ARCHIVE_OK);
    if (!content.empty()) archive_write_data(a, content.data(), content.size());
    archive_entry_free(entry);
  };
  add("../escaped", nullptr);
  add("../../escaped", nullptr);
  add((folder_ / "escaped").c_str(), nullptr);
  add("link", "/etc/passwd");
  add("link/inner", nullptr);
  archive_write_close(a);
  archive_write_free(a);
  const auto found = unpack("evil.zip");
  ASSERT_TRUE(found) << found.error().message;
  EXPECT_EQ(found->files.size(), 4u);
  EXPECT_EQ(found->skipped.count(FileKind::link), 1);
  EXPECT_EQ(files_of(folder_ / "out").size(), 1u);
  for (const fs::path& file : files_of(folder_ / "out" / "into"))
    EXPECT_TRUE(fs::is_regular_file(fs::symlink_status(file))) << file;
  EXPECT_FALSE(fs::exists(folder_ / "escaped"));
}

TEST(TemporaryFolder, GoesWithItsScope) {
  fs::path path;
  {
    const auto folder = TemporaryFolder::make();
    ASSERT_TRUE(folder) << folder.error().message;
    path = folder->path();
    fs::create_directories(path / "a" / "b");
    EXPECT_EQ(fs::status(path).permissions(), fs::perms::owner_all);
  }
  EXPECT_FALSE(fs::exists(path));
}

TEST(Isolated, ADeadChildIsReportedWithItsFile) {
  std::vector<std::string> heard;
  IsolatedWork work;
  work.run = [](ChildChannel& channel) -> Result<void> {
    channel.at_file(7);
    channel.send("before");
    std::abort();
  };
  work.on_message = [&](std::string_view message) {
    heard.emplace_back(message);
    return true;
  };
  const IsolatedEnd end = run_isolated(work, keep_going);
  EXPECT_TRUE(end.died);
  EXPECT_EQ(end.file, 7u);
  EXPECT_FALSE(end.result);
  EXPECT_EQ(heard, std::vector<std::string>{"before"});
}

TEST(Isolated, AChildThatHangsIsStopped) {
  IsolatedWork work;
  work.run = [](ChildChannel&) -> Result<void> {
    for (;;) ::pause();
  };
  work.on_message = [](std::string_view) { return true; };
  int asked = 0;
  const IsolatedEnd end = run_isolated(work, [&](double) { return ++asked < 5; });
  ASSERT_FALSE(end.result);
  EXPECT_EQ(end.result.error().code, ErrorCode::cancelled);
}

// Builds with sanitizers reserve far more memory than they use, so they have no limit. There the child must end
// normally.
TEST(Isolated, AChildThatTakesMoreThanItsMemoryDies) {
  IsolatedWork work;
  work.memory_bytes = std::size_t{64} << 20;
  work.run = [](ChildChannel& channel) -> Result<void> {
    // In one piece: small pieces could come from memory that the tests before have given back to the heap.
    const std::string all(std::size_t{512} << 20, 'x');
    channel.progress(all.back() == 'x' ? 0.5 : 0.0);
    return {};
  };
  work.on_message = [](std::string_view) { return true; };
  EXPECT_EQ(run_isolated(work, keep_going).died, limits_memory());
}

}  // namespace
}  // namespace osteon::import
