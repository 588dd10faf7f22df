#include "server/upload_validation/case_repository.hpp"

#include <gtest/gtest.h>

#include <fstream>
#include <sstream>

#include "common/volume/case.hpp"
#include "server/upload_validation/case_check.hpp"
#include "tests/support/process.hpp"
#include "tests/support/scenes/bones.hpp"
#include "tests/support/scenes/described_case.hpp"
#include "tests/support/temp_dir.hpp"

namespace osteon {
namespace {

namespace fs = std::filesystem;

std::string content_of(const fs::path& file) {
  std::ostringstream out;
  out << std::ifstream(file, std::ios::binary).rdbuf();
  return out.str();
}

class StoreTest : public ::testing::Test {
 protected:
  StoreTest() : bone_(test::plain_block(6, 3, 0.5)) {
    EXPECT_TRUE(bone_.save(temp_ / "case"));
    EXPECT_TRUE(pack_case(temp_ / "case", temp_ / "case.zip"));
    store_ = make_store({});
  }
  std::unique_ptr<CaseRepository> make_store(const UploadQuota& quota,
                                             const fs::path& program = test::program("osteon-server")) {
    auto store = CaseRepository::open(temp_ / "cases", program, quota);
    EXPECT_TRUE(store) << store.error().message;
    return std::move(*store);
  }
  static Result<StoredCase> keep(CaseRepository& store, const std::string& archive) {
    auto upload = store.begin();
    if (!upload) return tl::unexpected(upload.error());
    if (Result<void> added = (*upload)->add(archive); !added) return tl::unexpected(added.error());
    return store.keep(std::move(*upload));
  }
  [[nodiscard]] std::size_t left_over() const {
    std::size_t count = 0;
    for (const auto& entry : fs::directory_iterator(temp_ / "cases"))
      count += digest_from_hex(entry.path().filename().string()) ? 0 : 1;
    return count;
  }

  test::TempDir temp_;
  Case bone_;
  std::unique_ptr<CaseRepository> store_;
};

TEST_F(StoreTest, ACaseIsKeptUnderItsHashAndIsTheSameCase) {
  const auto stored = keep(*store_, content_of(temp_ / "case.zip"));
  ASSERT_TRUE(stored) << stored.error().message;
  EXPECT_EQ(stored->hash, bone_.hash());
  EXPECT_FALSE(stored->known);
  EXPECT_EQ(store_->folders(), std::vector{stored->folder});
  const auto again = Case::load(stored->folder);
  ASSERT_TRUE(again) << again.error().message;
  EXPECT_EQ(again->hash(), bone_.hash());
  // Its size in memory is known before it is read again.
  EXPECT_EQ(stored->memory_bytes, bone_.memory_bytes());
  const auto peeked = CaseRepository::peek(stored->folder);
  ASSERT_TRUE(peeked) << peeked.error().message;
  EXPECT_EQ(peeked->hash, bone_.hash());
  EXPECT_EQ(peeked->title, bone_.info().title);
  EXPECT_EQ(peeked->memory_bytes, bone_.memory_bytes());
  EXPECT_EQ(left_over(), 0U);

  const auto twice = keep(*store_, content_of(temp_ / "case.zip"));
  ASSERT_TRUE(twice) << twice.error().message;
  EXPECT_TRUE(twice->known);
  EXPECT_EQ(store_->folders().size(), 1U);
}

// A case with a scan and a plan, and what is stored of it.
class ScannedStoreTest : public StoreTest {
 protected:
  ScannedStoreTest() : scan_(test::turned_scan()), scanned_(*test::described_ball(test::full_description(scan_))) {
    EXPECT_TRUE(scanned_.save(folder_, scan_));
  }
  Result<StoredCase> stored() {
    fs::remove(temp_ / "scanned.zip");
    EXPECT_TRUE(pack_case(folder_, temp_ / "scanned.zip"));
    return keep(*store_, content_of(temp_ / "scanned.zip"));
  }
  const CaseScan scan_;
  const Case scanned_;
  const fs::path folder_ = temp_ / "scanned", file_ = folder_ / "scan.vdb";
};

TEST_F(ScannedStoreTest, TheScanIsKeptToo) {
  const auto kept = stored();
  ASSERT_TRUE(kept) << kept.error().message;
  EXPECT_EQ(kept->hash, scanned_.hash());
  const auto again = Case::load(kept->folder);
  ASSERT_TRUE(again) << again.error().message;
  EXPECT_EQ(again->info(), scanned_.info());
  const auto scan = load_scan(kept->folder, *again);
  ASSERT_TRUE(scan) << scan.error().message;
  EXPECT_EQ(scan->hu, scan_.hu);
  EXPECT_EQ(scan->labels, scan_.labels);
  EXPECT_EQ(scan->tissue, scan_.tissue);
}

TEST_F(ScannedStoreTest, ItMayBeLeftOut) {
  fs::remove(file_);
  const auto kept = stored();
  ASSERT_TRUE(kept) << kept.error().message;
  EXPECT_EQ(kept->hash, scanned_.hash());
  EXPECT_FALSE(fs::exists(kept->folder / "scan.vdb"));
  // It may come later, and is not lost when it is left out again.
  ASSERT_TRUE(save_scan(file_, scan_));
  const auto later = stored();
  ASSERT_TRUE(later) << later.error().message;
  EXPECT_TRUE(later->known);
  EXPECT_TRUE(load_scan(kept->folder, scanned_));
  fs::remove(file_);
  ASSERT_TRUE(stored());
  EXPECT_TRUE(load_scan(kept->folder, scanned_));
}

TEST_F(ScannedStoreTest, AScanThatIsDamagedOrOfNoCaseIsRefused) {
  const auto expect_refused = [&](const std::string& named) {
    const auto out = stored();
    ASSERT_FALSE(out) << named;
    EXPECT_EQ(out.error().code, ErrorCode::invalid_input) << out.error().message;
    EXPECT_NE(out.error().message.find(named), std::string::npos) << out.error().message;
    EXPECT_EQ(left_over(), 0U);
    EXPECT_TRUE(store_->folders().empty());
  };
  const std::string sound = content_of(file_);
  std::ofstream(file_, std::ios::binary) << sound.substr(0, sound.size() / 2);
  expect_refused("scan.vdb");
  CaseScan other = scan_;
  ++other.hu[3];
  fs::remove(file_);
  ASSERT_TRUE(save_scan(file_, other));
  expect_refused("scan.hash differs");
  fs::copy_file(temp_ / "case" / "case.json", folder_ / "case.json", fs::copy_options::overwrite_existing);
  fs::copy_file(temp_ / "case" / "bone.vdb", folder_ / "bone.vdb", fs::copy_options::overwrite_existing);
  expect_refused("has no scan");
}

// The hash of a case or the format of its files covers every byte. With a flipped byte it is another case, or none.
TEST_F(StoreTest, ADamagedCaseIsRefusedAndNothingIsLeft) {
  const std::string vdb = content_of(temp_ / "case" / "bone.vdb");
  for (int i = 0; i < 12; ++i) {
    std::string broken = vdb;
    broken[vdb.size() * static_cast<std::size_t>(i) / 12 + 7] ^= 0x41;
    std::ofstream(temp_ / "case" / "bone.vdb", std::ios::binary) << broken;
    ASSERT_TRUE(pack_case(temp_ / "case", temp_ / "broken.zip"));
    const auto out = keep(*store_, content_of(temp_ / "broken.zip"));
    if (out) {
      EXPECT_EQ(out->hash, bone_.hash());  // the byte has no meaning
      continue;
    }
    EXPECT_TRUE(out.error().code == ErrorCode::invalid_input || out.error().code == ErrorCode::exhausted)
        << out.error().message;
  }
  std::ofstream(temp_ / "case" / "bone.vdb", std::ios::binary) << std::string(100, 'x');
  ASSERT_TRUE(pack_case(temp_ / "case", temp_ / "broken.zip"));
  EXPECT_FALSE(keep(*store_, content_of(temp_ / "broken.zip")));
  EXPECT_EQ(left_over(), 0U);
}

TEST_F(StoreTest, QuotasHold) {
  const std::string archive = content_of(temp_ / "case.zip");
  auto small = make_store({.archive_bytes = 100});
  const auto out = keep(*small, archive);
  ASSERT_FALSE(out);
  EXPECT_EQ(out.error().code, ErrorCode::exhausted);

  // One byte less than the case needs once it is written again. That shows only at the end, and nothing of it is left.
  const auto kept = keep(*store_, archive);
  ASSERT_TRUE(kept) << kept.error().message;
  fs::remove_all(kept->folder);
  auto tight = make_store({.kept_bytes = kept->bytes - 1});
  const auto beyond = keep(*tight, archive);
  ASSERT_FALSE(beyond);
  EXPECT_EQ(beyond.error().code, ErrorCode::exhausted);
  EXPECT_TRUE(tight->folders().empty());
  // Exactly as much as it needs: it is stored, and then the store is full before anything is sent.
  auto full = make_store({.kept_bytes = kept->bytes});
  ASSERT_TRUE(keep(*full, archive));
  const auto no_more = full->begin();
  ASSERT_FALSE(no_more);
  EXPECT_EQ(no_more.error().code, ErrorCode::exhausted);

  std::vector<std::unique_ptr<Upload>> open;
  for (int i = 0; i < CaseRepository::kMostUploads; ++i) {
    auto one = store_->begin();
    ASSERT_TRUE(one);
    open.push_back(std::move(*one));
  }
  EXPECT_FALSE(store_->begin());
  open.pop_back();
  EXPECT_TRUE(store_->begin());
}

TEST_F(StoreTest, AReaderThatDiesOrHangsOrWantsTooMuchIsOneSentence) {
  const std::string archive = content_of(temp_ / "case.zip");
  const auto with = [&](const std::string& script, const UploadQuota& quota = {}) {
    const fs::path program = temp_ / "reader";
    std::ofstream(program) << "#!/bin/sh\n" << script << "\n";
    fs::permissions(program, fs::perms::owner_all);
    auto store = make_store(quota, program);
    const auto out = keep(*store, archive);
    EXPECT_FALSE(out) << script;
    return out ? Error{} : out.error();
  };
  EXPECT_EQ(with("kill -SEGV $$").code, ErrorCode::invalid_input);
  EXPECT_EQ(with("exit 0").code, ErrorCode::invalid_input);
  EXPECT_EQ(with("echo '{\"hash\":\"00\",\"title\":\"x\"}'").code, ErrorCode::invalid_input);
  EXPECT_EQ(with("exec sleep 60", {.time = std::chrono::seconds(1)}).code, ErrorCode::exhausted);
  // A process that an attacker has taken over leaves something that is not a case.
  const std::string hash(64, 'a');
  const std::string lie = "echo '{\"hash\":\"" + hash + "\",\"title\":\"x\",\"memory_bytes\":1}'";
  EXPECT_EQ(with(lie).code, ErrorCode::invalid_input) << "there is no case";
  const std::string plain = "mkdir $3/sound; echo > $3/sound/case.json; ";
  EXPECT_EQ(with(plain + "ln -s /etc/passwd $3/sound/bone.vdb; " + lie).code, ErrorCode::invalid_input)
      << "the file is a link";
  EXPECT_EQ(with(plain + "echo > $3/sound/bone.vdb; echo > $3/sound/more; " + lie).code, ErrorCode::invalid_input)
      << "there are more files than in a case";
  EXPECT_EQ(with(plain + "echo > $3/sound/scan.vdb; " + lie).code, ErrorCode::invalid_input) << "there is no bone";
  EXPECT_EQ(with("mkdir $3/real; ln -s real $3/sound; echo > $3/real/case.json; echo > $3/real/bone.vdb; " + lie).code,
            ErrorCode::invalid_input);
  EXPECT_EQ(with("exec yes").code, ErrorCode::exhausted);
  EXPECT_EQ(with("exec 1>&-; exec sleep 60").code, ErrorCode::invalid_input);  // it closes its output and stays
  EXPECT_EQ(left_over(), 0U);
  // The real program, with less memory than a case needs.
  auto poor = make_store({.memory_bytes = 8 << 20});
  EXPECT_FALSE(keep(*poor, archive));
  auto none = make_store({}, temp_ / "no-such-program");
  const auto out = keep(*none, archive);
  ASSERT_FALSE(out);
  EXPECT_EQ(out.error().code, ErrorCode::internal);
}

TEST_F(StoreTest, WhatIsNotWantedAnyMoreIsGivenUp) {
  const fs::path program = temp_ / "reader";
  std::ofstream(program) << "#!/bin/sh\nexec sleep 60\n";
  fs::permissions(program, fs::perms::owner_all);
  auto store = make_store({}, program);
  auto upload = store->begin();
  ASSERT_TRUE(upload && (*upload)->add(content_of(temp_ / "case.zip")));
  const auto out = store->keep(std::move(*upload), [] { return true; });
  ASSERT_FALSE(out);
  EXPECT_EQ(out.error().code, ErrorCode::cancelled);
  EXPECT_EQ(left_over(), 0U);
}

TEST_F(StoreTest, WhatAnEarlierProcessLeftHalfDoneGoes) {
  fs::create_directories(temp_ / "cases" / "incoming-1-1" / "sent");
  store_ = make_store({});
  EXPECT_EQ(left_over(), 0U);
}

TEST(CaseRepository, AFolderThatCannotBeMadeIsSaid) {
  const test::TempDir temp;
  std::ofstream(temp / "file") << "x";
  const auto out = CaseRepository::open(temp / "file" / "cases", "/bin/true");
  ASSERT_FALSE(out);
  EXPECT_NE(out.error().message.find("--cases"), std::string::npos);
}

}  // namespace
}  // namespace osteon
