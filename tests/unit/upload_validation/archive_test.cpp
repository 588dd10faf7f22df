#include "server/upload_validation/case_archive.hpp"

#include <gtest/gtest.h>

#include <fstream>
#include <string>
#include <vector>

#include "tests/support/temp_dir.hpp"
#include "tests/unit/upload_validation/zip_bytes.hpp"

namespace osteon {
namespace {

using test::Bytes;
using test::Entry;
using test::zip;

struct Unpacked {
  std::map<std::string, std::string> files;
  std::size_t pieces_bytes = 0;
};

Result<Unpacked> unpack(const Bytes& bytes, const UploadQuota& quota = {}) {
  Unpacked out;
  const auto done = unpack_case(bytes, "a.zip", quota, [&](std::string_view file, std::span<const std::byte> piece) {
    out.files[std::string(file)].append(reinterpret_cast<const char*>(piece.data()), piece.size());
    out.pieces_bytes += piece.size();
    return Result<void>{};
  });
  if (!done) return tl::unexpected(done.error());
  for (const auto& [file, size] : *done) EXPECT_EQ(size, out.files[file].size());
  return out;
}

const std::vector<Entry> kCase{{"case.json", "{}"}, {"bone.vdb", "not really"}};

std::vector<Entry> with(Entry more) {
  std::vector<Entry> all = kCase;
  all.push_back(std::move(more));
  return all;
}

TEST(CaseArchive, FilesAtTheTopOrInOneFolderComeOut) {
  const auto top = unpack(zip(kCase));
  ASSERT_TRUE(top) << top.error().message;
  EXPECT_EQ(top->files.at("bone.vdb"), "not really");
  const auto within =
      unpack(zip({{"skull/", "", "", false, test::kFolderEntry}, {"skull/case.json", "{}"}, {"skull/bone.vdb", "x"}}));
  ASSERT_TRUE(within) << within.error().message;
  EXPECT_EQ(within->files.size(), 2U);
}

TEST(CaseArchive, TheScanMayComeToo) {
  const auto out = unpack(zip(with({"scan.vdb", "voxels"})));
  ASSERT_TRUE(out) << out.error().message;
  EXPECT_EQ(out->files.at("scan.vdb"), "voxels");
  EXPECT_FALSE(unpack(zip({{"case.json", "{}"}, {"scan.vdb", "x"}}))) << "it does not replace the bone";
}

TEST(CaseArchive, NothingElseIsTaken) {
  struct Evil {
    const char* what;
    Entry entry;
  };
  const std::vector<Evil> evil{
      {"up", {"../case.json", "{}"}},
      {"further up", {"../../etc/passwd", "x"}},
      {"up from a folder", {"a/../../bone.vdb", "x"}},
      {"absolute", {"/tmp/bone.vdb", "x"}},
      {"backslashes", {"..\\bone.vdb", "x"}},
      {"a folder of backslashes", {"..\\x/bone.vdb", "x"}},
      {"another file", {"readme.txt", "x"}},
      {"a hidden ending", {"bone.vdb/x", "x"}},
      {"a symbolic link", {"bone.vdb", "", "/etc/passwd", false, test::kLinkEntry}},
      {"a name of nothing", {"", "x"}},
      {"twice", {"case.json", "{\"other\":1}"}},
      {"in another folder", {"b/case.json", "{}"}},
      {"a folder that is the one it is in", {"./case.json", "{}"}},
      {"very long", {std::string(5000, 'a'), "x"}},
  };
  for (const Evil& one : evil) {
    const auto out = unpack(zip(with(one.entry)));
    ASSERT_FALSE(out) << one.what;
    EXPECT_EQ(out.error().code, ErrorCode::invalid_input) << one.what << ": " << out.error().message;
    EXPECT_NE(out.error().message.find("a.zip"), std::string::npos);
  }
}

TEST(CaseArchive, WhatIsMissingIsNamed) {
  const auto out = unpack(zip({{"case.json", "{}"}}));
  ASSERT_FALSE(out);
  EXPECT_NE(out.error().message.find("bone.vdb"), std::string::npos);
}

TEST(CaseArchive, EncryptedIsSaid) {
  const auto out = unpack(zip(kCase, "zip:encryption=traditional"));
  ASSERT_FALSE(out);
  EXPECT_EQ(out.error().code, ErrorCode::invalid_input);
}

TEST(CaseArchive, BombsStopAtTheQuota) {
  const std::string zeros(32 << 20, '\0');
  const Bytes bomb = zip({{"case.json", "{}"}, {"bone.vdb", zeros}});
  ASSERT_LT(bomb.size(), zeros.size() / 500);
  const auto ratio = unpack(bomb);
  ASSERT_FALSE(ratio);
  EXPECT_EQ(ratio.error().code, ErrorCode::exhausted) << ratio.error().message;
  EXPECT_TRUE(unpack(bomb, {.ratio = 1e6}));

  std::size_t put = 0;
  const UploadQuota small{.unpacked_bytes = 1 << 20, .ratio = 1e6};
  const auto bytes = unpack_case(bomb, "a.zip", small, [&](std::string_view, std::span<const std::byte> piece) {
    put += piece.size();
    return Result<void>{};
  });
  ASSERT_FALSE(bytes);
  EXPECT_EQ(bytes.error().code, ErrorCode::exhausted);
  EXPECT_LE(put, small.unpacked_bytes);  // no byte beyond the quota was written

  std::vector<Entry> many = kCase;
  for (int i = 0; i < 20; ++i) many.push_back({"d" + std::to_string(i) + "/", "", "", false, test::kFolderEntry});
  const auto entries = unpack(zip(many));
  ASSERT_FALSE(entries);
  EXPECT_EQ(entries.error().code, ErrorCode::exhausted);
}

TEST(CaseArchive, DamagedAndOtherFilesAreSaid) {
  const Bytes whole = zip({{"case.json", "{}"}, {"bone.vdb", std::string(10000, 'x')}});
  for (std::size_t length = 0; length < whole.size(); ++length) {
    Bytes cut(whole.begin(), whole.begin() + static_cast<std::ptrdiff_t>(length));
    const auto out = unpack(cut);
    EXPECT_TRUE(out || out.error().code == ErrorCode::invalid_input) << length;
    EXPECT_FALSE(out && length < 30) << length;
  }
  const auto folder = unpack_case(std::filesystem::path("/"), {}, [](auto, auto) { return Result<void>{}; });
  EXPECT_FALSE(folder);
  const auto missing =
      unpack_case(std::filesystem::path("/no/such.zip"), {}, [](auto, auto) { return Result<void>{}; });
  ASSERT_FALSE(missing);
  EXPECT_EQ(missing.error().code, ErrorCode::not_found);
}

// Readers find the files by the record at the end, and by the list before it, whose entries begin with PK\1\2. One
// damaged bit there removes no file.
TEST(CaseArchive, ADamagedListOfFilesIsNoMissingFile) {
  const Bytes whole = zip(kCase);
  const std::string_view text(reinterpret_cast<const char*>(whole.data()), whole.size());
  std::vector<std::size_t> places;
  for (std::size_t at = text.find("PK\1\2"); at != std::string_view::npos; at = text.find("PK\1\2", at + 1))
    for (std::size_t i = 0; i < 4; ++i) places.push_back(at + i);
  ASSERT_EQ(places.size(), 8u);
  for (std::size_t at = text.rfind("PK\5\6"); at < whole.size(); ++at) places.push_back(at);
  ASSERT_EQ(places.size(), 8u + 22u);
  for (const std::size_t at : places)
    for (int bit = 0; bit < 8; ++bit) {
      Bytes flipped = whole;
      flipped[at] ^= static_cast<std::byte>(1 << bit);
      const auto out = unpack(flipped);
      if (out) continue;  // the files were found all the same
      EXPECT_NE(out.error().message.find("is not a sound zip archive"), std::string::npos)
          << at << ", bit " << bit << ": " << out.error().message;
    }
}

TEST(CaseArchive, AFullDiskIsPassedOn) {
  const auto out =
      unpack_case(zip(kCase), "a.zip", {}, [](std::string_view, std::span<const std::byte>) -> Result<void> {
        return failure(ErrorCode::internal, "the disk takes no more");
      });
  ASSERT_FALSE(out);
  EXPECT_EQ(out.error().code, ErrorCode::internal);
}

TEST(CaseArchive, WhatIsPackedUnpacksTheSame) {
  const test::TempDir temp;
  std::filesystem::create_directory(temp / "case");
  std::string content(3 << 20, 'a');
  for (std::size_t i = 0; i < content.size(); ++i) content[i] = static_cast<char>(i * i >> 7);
  std::ofstream(temp / "case" / "case.json") << "{\"title\":1}";
  std::ofstream(temp / "case" / "bone.vdb", std::ios::binary) << content;
  ASSERT_TRUE(pack_case(temp / "case", temp / "case.zip"));
  std::map<std::string, std::string> files;
  const auto out = unpack_case(temp / "case.zip", {}, [&](std::string_view file, std::span<const std::byte> piece) {
    files[std::string(file)].append(reinterpret_cast<const char*>(piece.data()), piece.size());
    return Result<void>{};
  });
  ASSERT_TRUE(out) << out.error().message;
  EXPECT_EQ(files.size(), 2u);
  EXPECT_EQ(files.at("bone.vdb"), content);
  EXPECT_EQ(files.at("case.json"), "{\"title\":1}");
  std::ofstream(temp / "case" / "scan.vdb", std::ios::binary) << "voxels";
  ASSERT_TRUE(pack_case(temp / "case", temp / "scanned.zip"));
  files.clear();
  ASSERT_TRUE(unpack_case(temp / "scanned.zip", {}, [&](std::string_view file, std::span<const std::byte> piece) {
    files[std::string(file)].append(reinterpret_cast<const char*>(piece.data()), piece.size());
    return Result<void>{};
  }));
  EXPECT_EQ(files.size(), 3u);
  EXPECT_EQ(files.at("scan.vdb"), "voxels");
  std::filesystem::remove(temp / "case" / "case.json");
  const auto none = pack_case(temp / "case", temp / "other.zip");
  ASSERT_FALSE(none);
  EXPECT_EQ(none.error().code, ErrorCode::not_found);
}

}  // namespace
}  // namespace osteon
