#include "server/storage/case_cache.hpp"

#include <system_error>
#include <utility>

namespace osteon {

void CaseCache::keep(ServedCase served) {
  const auto bone = std::make_shared<const Case>(std::move(served.bone));  // shared with its rooms
  const MutexLock lock(mutex_);
  entries_[bone->hash()] = {
      {bone->hash(), bone->info().title, std::move(served.folder), bone->memory_bytes()}, bone, bone};
}

void CaseCache::add(KnownCase known) {
  const MutexLock lock(mutex_);
  const Digest hash = known.hash;
  entries_.try_emplace(hash, Entry{std::move(known), nullptr, {}});
}

std::optional<KnownCase> CaseCache::find(const Digest& hash) const {
  const MutexLock lock(mutex_);
  const auto found = entries_.find(hash);
  return found == entries_.end() ? std::nullopt : std::optional(found->second.known);
}

std::vector<KnownCase> CaseCache::all() const {
  const MutexLock lock(mutex_);
  std::vector<KnownCase> all;
  for (const auto& [hash, entry] : entries_) all.push_back(entry.known);
  return all;
}

std::uint64_t CaseCache::loaded_bytes() const {
  const MutexLock lock(mutex_);
  return loaded_locked();
}

std::uint64_t CaseCache::loaded_locked() const {
  std::uint64_t bytes = 0;
  for (const auto& [hash, entry] : entries_)
    if (!entry.loaded.expired()) bytes += entry.known.memory_bytes;
  return bytes;
}

Result<void> CaseCache::check_space(const KnownCase& known, std::uint64_t bytes) const {
  const std::uint64_t loaded = loaded_locked();
  if (bytes <= most_bytes_ && loaded <= most_bytes_ - bytes) return {};
  const auto mib = [](std::uint64_t n) { return std::to_string((n + (1 << 20) - 1) >> 20); };
  return failure(ErrorCode::exhausted, "the case " + to_hex(known.hash) + " needs " + mib(bytes) +
                                           " MiB of memory, and " + mib(loaded) + " of the " +
                                           std::to_string(most_bytes_ >> 20) +
                                           " MiB that cases may take are in use; close rooms of other cases, or " +
                                           "start the server with a larger --case-memory-mib");
}

Result<LoadedCase> CaseCache::load(const Digest& hash) {
  const MutexLock loading(loading_);
  KnownCase known;
  {
    const MutexLock lock(mutex_);
    const auto found = entries_.find(hash);
    if (found == entries_.end()) return failure(ErrorCode::not_found, "the server has no case " + to_hex(hash));
    known = found->second.known;
    if (auto bone = found->second.loaded.lock()) return LoadedCase{std::move(bone), known.folder};
    // Refused before it is read, by the memory that it needs. If this is not known yet, by the size of its file, which
    // is smaller.
    std::error_code none;
    const std::uint64_t file = std::filesystem::file_size(known.folder / "bone.vdb", none);
    const std::uint64_t least = known.memory_bytes != 0 ? known.memory_bytes : none ? 0 : file;
    if (Result<void> fits = check_space(known, least); !fits) return tl::unexpected(fits.error());
  }
  Result<Case> read = Case::load(known.folder);
  if (!read) return tl::unexpected(read.error());
  if (read->hash() != hash)
    return failure(ErrorCode::invalid_input,
                   known.folder.string() + " holds another case than " + to_hex(hash) + "; upload that case again");
  const auto bone = std::make_shared<const Case>(std::move(*read));  // shared by its rooms
  const MutexLock lock(mutex_);
  if (Result<void> fits = check_space(known, bone->memory_bytes()); !fits) return tl::unexpected(fits.error());
  Entry& entry = entries_.at(hash);
  entry.known.memory_bytes = bone->memory_bytes();
  entry.loaded = bone;
  return LoadedCase{bone, known.folder};
}

}  // namespace osteon
