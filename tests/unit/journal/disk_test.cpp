// The disk in memory: which data it may lose, and which it must not. The computer's own disk keeps the same promises.
#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <cstdio>
#include <map>
#include <thread>
#include <vector>

#include "tests/support/disk/memory_disk.hpp"
#include "tests/support/temp_dir.hpp"

namespace osteon {
namespace {

using test::MemoryDisk;

void write(Disk& disk, const std::filesystem::path& file, std::string_view bytes, bool synced) {
  auto made = disk.create(file);
  ASSERT_TRUE(made && (*made)->write(bytes));
  if (synced) {
    ASSERT_TRUE((*made)->sync());
  }
}

TEST(MemoryDisk, KeepsWhatWasSyncedAndMayForgetTheRest) {
  std::map<std::string, int> outcomes;
  const std::string old(3000, 'o');
  for (std::uint64_t seed = 1; seed <= 300; ++seed) {
    MemoryDisk disk(seed, 512);
    write(disk, "/a/kept", old, true);
    ASSERT_TRUE(disk.sync_folder("/a"));
    write(disk, "/a/unnamed", old, true);  // Its name is not synced.
    ASSERT_TRUE(disk.rename("/a/unnamed", "/a/renamed"));
    {
      auto file = disk.create("/a/tail");
      ASSERT_TRUE(file && (*file)->write(old) && (*file)->sync() && disk.sync_folder("/b"));
      ASSERT_TRUE((*file)->write(std::string(3000, 'n')));
      EXPECT_EQ(disk.read("/a/tail", 3000, 9000).value(), std::string(3000, 'n')) << "it can be read at once";
    }
    disk.power_returns();
    ASSERT_EQ(disk.read("/a/kept", 0, 9000).value(), old);
    const bool unnamed = disk.size("/a/unnamed").value().has_value(),
               renamed = disk.size("/a/renamed").value().has_value();
    ASSERT_FALSE(unnamed && renamed) << "a rename happens or does not";
    ++outcomes[unnamed ? "not renamed" : renamed ? "renamed" : "not there"];
    if (!disk.size("/a/tail").value()) {
      ++outcomes["no tail"];
      continue;
    }
    const std::string tail = disk.read("/a/tail", 0, 9000).value();
    ASSERT_GE(tail.size(), 3000u);
    // The whole sectors before the sector that both writes share are safe.
    ASSERT_EQ(tail.substr(0, 2560), old.substr(0, 2560));
    if (tail.size() == 3000) ++outcomes["tail not longer"];
    if (tail == old + std::string(3000, 'n')) ++outcomes["tail whole"];
    if (tail.size() > 3000 && tail != old + std::string(3000, 'n')) ++outcomes["tail torn"];
    if (tail.substr(0, 3000) != old) ++outcomes["shared sector spoiled"];
  }
  for (const char* outcome :
       {"not renamed", "renamed", "not there", "no tail", "tail not longer", "tail torn", "shared sector spoiled"})
    EXPECT_GT(outcomes[outcome], 0) << outcome;
}

// As on Linux: after a failed sync a page looks written and is not, or is as it was before. A later sync does not write
// it.
TEST(MemoryDisk, DoesNotWriteLaterWhatASyncFailedToWrite) {
  int looked_written = 0, forgotten = 0;
  for (std::uint64_t seed = 1; seed <= 100; ++seed) {
    MemoryDisk disk(seed, 512);
    auto file = disk.create("/a/file");
    ASSERT_TRUE(file && (*file)->write(std::string(512, 'o')) && (*file)->sync() && disk.sync_folder("/a"));
    ASSERT_TRUE((*file)->write(std::string(512, 'n')));
    disk.fail_sync_at(1, EIO);
    ASSERT_FALSE((*file)->sync());
    ASSERT_TRUE((*file)->sync()) << "the next sync reports success";
    file->reset();
    const bool seen = disk.read("/a/file", 512, 512).value() == std::string(512, 'n');
    disk.power_returns();
    const bool kept = disk.read("/a/file", 512, 512).value() == std::string(512, 'n');
    looked_written += seen && !kept ? 1 : 0;
    forgotten += kept ? 0 : 1;
  }
  EXPECT_GT(looked_written, 10);
  EXPECT_GT(forgotten, looked_written);
}

TEST(MemoryDisk, FailsWhereItIsTold) {
  MemoryDisk disk(1);
  auto file = disk.create("/a/file");
  ASSERT_TRUE(file);
  disk.fail_write_at(2, ENOSPC);
  EXPECT_TRUE((*file)->write("1"));
  const auto full = (*file)->write("2");
  ASSERT_FALSE(full);
  EXPECT_EQ(full.error().message, "cannot write /a/file: No space left on device; make room on the disk");
  EXPECT_TRUE(disk.has_failed());
  EXPECT_TRUE((*file)->write("3"));
  disk.fail_at(3, EIO, MemoryDisk::Lasting::from_then_on);
  EXPECT_TRUE((*file)->write("4"));
  EXPECT_TRUE((*file)->sync());
  for (int i = 0; i < 3; ++i) EXPECT_FALSE((*file)->sync());
  EXPECT_FALSE(disk.rename("/a/file", "/a/other"));
  disk.mend();
  EXPECT_TRUE((*file)->sync());
  disk.fail_power_at(1);
  EXPECT_FALSE((*file)->write("5"));
  EXPECT_FALSE(disk.read("/a/file", 0, 1));
  file->reset();
  disk.power_returns();
  EXPECT_FALSE(disk.has_failed());
}

TEST(MemoryDisk, IsTheSameForTheSameSeed) {
  const auto run = [](std::uint64_t seed) {
    MemoryDisk disk(seed, 512);
    for (std::size_t i = 0; i < 9; ++i) write(disk, "/a/" + std::to_string(i), std::string(700 * i, 'x'), i % 2 == 0);
    disk.power_returns();
    return disk.image();
  };
  EXPECT_EQ(run(7), run(7));
  EXPECT_NE(run(7), run(8));
}

// One list of promises for both disks.
void keep_promises(Disk& disk, const std::filesystem::path& folder) {
  EXPECT_EQ(disk.size(folder / "none").value(), std::nullopt);
  EXPECT_EQ(disk.read(folder / "none", 0, 1).error().code, ErrorCode::not_found);
  EXPECT_TRUE(disk.remove(folder / "none"));
  {
    auto file = DurableFile::begin(disk, folder / "file");
    ASSERT_TRUE(file && file->write("ab") && file->write("c"));
    EXPECT_EQ(disk.size(folder / "file").value(), std::nullopt) << "the file must not be visible before it is whole";
    const auto written = file->finish();
    ASSERT_TRUE(written);
    EXPECT_EQ(written->size, 3u);
    EXPECT_EQ(to_hex(written->digest), "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad")
        << "FIPS 180-2, B.1";
  }
  { ASSERT_TRUE(DurableFile::begin(disk, folder / "dropped")->write("x")); }
  EXPECT_EQ(disk.list(folder).value(), std::vector<std::string>{"file"});
  EXPECT_EQ(disk.read(folder / "file", 1, 9).value(), "bc");
  std::string all;
  const auto read = read_in_pieces(disk, folder / "file", [&](std::string_view piece) {
    all += piece;
    return Result<void>{};
  });
  EXPECT_EQ(all, "abc");
  EXPECT_EQ(read->size, 3u);
  EXPECT_EQ(disk.lock(folder / "none", LockKind::exclusive).error().code, ErrorCode::not_found);
  {
    auto opened = disk.open(folder / "file");
    ASSERT_TRUE(opened && (*opened)->write("d") && (*opened)->write_at(1, "X") && (*opened)->write_durably(5, "f"));
    EXPECT_EQ(disk.read(folder / "file", 0, 9).value(), std::string("aXcd\0f", 6));
  }
  const auto identity = disk.identity(folder / "file").value();
  ASSERT_TRUE(identity);
  EXPECT_EQ(identity->size, 6u);
  auto held = disk.lock(folder / "file", LockKind::exclusive);
  ASSERT_TRUE(held);
  for (const LockKind kind : {LockKind::exclusive, LockKind::shared})
    EXPECT_EQ(disk.lock(folder / "file", kind).error().code, ErrorCode::exists);
  ASSERT_TRUE(disk.rename(folder / "file", folder / "renamed"));
  EXPECT_TRUE(disk.identity(folder / "renamed").value()->same_file(*identity));
  EXPECT_EQ(disk.lock(folder / "renamed", LockKind::shared).error().code, ErrorCode::exists)
      << "the lock is on the file, not on its name";
  held->reset();
  const auto one = disk.lock(folder / "renamed", LockKind::shared),
             two = disk.lock(folder / "renamed", LockKind::shared);
  EXPECT_TRUE(one && two);
  EXPECT_EQ(disk.lock(folder / "renamed", LockKind::exclusive).error().code, ErrorCode::exists);
  std::filesystem::path scratch;
  {
    const auto made = disk.scratch_folder();
    ASSERT_TRUE(made);
    scratch = (*made)->path();
    write(disk, scratch / "inside", "x", true);
    EXPECT_EQ(disk.size(scratch / "inside").value(), 1u);
  }
  EXPECT_EQ(disk.size(scratch / "inside").value(), std::nullopt);
}

TEST(Disks, KeepTheSamePromises) {
  MemoryDisk memory(1);
  keep_promises(memory, "/a");
  const test::TempDir folder;
  keep_promises(system_disk(), folder.path());
}

// As somebody does who deletes a journal while others try to open it.
TEST(Disks, ALockWhoseFileIsRemovedByItsHolderIsStillHeldByOneAlone) {
  const test::TempDir folder;
  const std::filesystem::path file = folder.path() / "lock";
  std::atomic<int> holders = 0, most = 0, held = 0;
  const auto take_turns = [&] {
    for (int i = 0; i < 5000; ++i) {
      if (!system_disk().open(file)) continue;
      const auto lock = system_disk().lock(file, LockKind::exclusive);
      if (!lock) continue;
      most = std::max<int>(most, ++holders);
      ++held;
      std::this_thread::yield();  // Gives others a chance to lock it too.
      --holders;
      ASSERT_TRUE(system_disk().remove(file));  // From here on anybody may use the name.
    }
  };
  std::vector<std::thread> threads;
  for (int i = 0; i < 4; ++i) threads.emplace_back(take_turns);
  for (std::thread& thread : threads) thread.join();
  EXPECT_EQ(most, 1);
  EXPECT_GT(held, 0);
  std::printf("%d locks held, never more than %d at a time\n", held.load(), most.load());
}

}  // namespace
}  // namespace osteon
