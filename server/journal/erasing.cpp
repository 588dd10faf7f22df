// Entries of which something was erased. The chain still covers their original hash, and a sealed register records what
// replaces them.
#include <utility>

#include "common/core/check.hpp"
#include "server/journal/bytes.hpp"
#include "server/journal/journal_state.hpp"

namespace osteon {
namespace {

constexpr std::size_t kEntryBytes = 8 + 2 * sizeof(Digest::bytes);

Digest digest_of_entry(std::string_view bytes) {
  Hasher hasher;
  hasher.text(bytes);
  return hasher.finish();
}

}  // namespace

std::string encode_erased(const ErasedEntries& entries) {
  std::string bytes;
  for (const auto& [seq, entry] : entries)
    bytes += encode_number(seq) + std::string(as_text(entry.chain)) + std::string(as_text(entry.bytes));
  return bytes;
}

std::optional<ErasedEntries> decode_erased(std::string_view bytes) {
  if (bytes.size() % kEntryBytes != 0) return std::nullopt;
  ErasedEntries entries;
  for (; !bytes.empty(); bytes.remove_prefix(kEntryBytes))
    entries[*decode_number(bytes.substr(0, 8))] = {*digest_of(bytes.substr(8, 32)), *digest_of(bytes.substr(40, 32))};
  return entries;
}

Result<void> JournalFile::read_erased() {
  const auto stored = find_register(kErasedRegister);
  if (!stored) return tl::unexpected(stored.error());
  if (!*stored) return {};
  std::optional<ErasedEntries> entries = decode_erased(**stored);
  if (!entries) return damaged("its register " + std::string(kErasedRegister));
  erased_ = std::move(*entries);
  return {};
}

JournalHead JournalFile::next_in_chain(const JournalHead& before, const JournalEntry& entry) const {
  const auto erased = erased_.find(entry.seq.value);
  if (erased != erased_.end() && erased->second.bytes == digest_of_entry(entry.bytes))
    return {entry.seq, erased->second.chain};
  return next_head(before, entry);
}

Result<void> JournalFile::erase(std::span<const JournalEntry> instead) {
  auto statement = database_.prepare("UPDATE rows SET bytes = ? WHERE place = ?");
  if (!statement) return tl::unexpected(statement.error());
  for (const JournalEntry& entry : instead) {
    const auto chain = chain_at(entry.seq);
    if (!chain) return tl::unexpected(chain.error());
    OSTEON_CHECK(chain->has_value());
    if (Result<void> put = statement->blob(0, entry.bytes).integer(1, static_cast<std::int64_t>(entry.seq.value)).run();
        !put)
      return put;
    erased_[entry.seq.value] = {**chain, digest_of_entry(entry.bytes)};
  }
  return set_register(kErasedRegister, encode_erased(erased_));
}

Result<std::size_t> Journal::erase_entries(
    const std::function<std::optional<std::string>(const JournalEntry&)>& without) {
  State& state = *state_;
  if (state.closed) return tl::unexpected(*state.closed);
  std::vector<JournalEntry> instead;
  const Result<void> read_all = read(RoomSeq{1}, [&](const JournalEntry& entry) {
    if (auto bytes = without(entry)) instead.push_back({entry.seq, entry.at_ns, std::move(*bytes)});
    return true;
  });
  if (!read_all) return tl::unexpected(read_all.error());
  if (instead.empty()) return 0;
  const auto signatures = state.file.signed_entries();
  if (!signatures) return tl::unexpected(signatures.error());
  if (!signatures->empty() && !state.options.keys)
    return failure(ErrorCode::denied, state.path.string() +
                                          " was signed by its server, which has to sign what is erased too; "
                                          "give its key with --signing-key FILE");
  Database& database = state.file.database();
  // Pages that held the entries before may contain copies of them, and so may the log's file after its end.
  const Result<void> done = write([&] {
    return state.file.erase(instead)
        .and_then([&] { return keep_signature(); })
        .and_then([&] { return database.commit(); })
        .and_then([&] { return database.run("VACUUM"); })
        .and_then([&] { return database.begin(); })
        .and_then([&] { return carry(); })
        .and_then([&] { return state.log->wipe(); });
  });
  if (!done) return tl::unexpected(done.error());
  return instead.size();
}

}  // namespace osteon
