// Journals as programs of earlier versions made them, with the tables of those versions.
#pragma once
#include <filesystem>
#include <vector>

#include "server/journal/chain.hpp"

namespace osteon {

enum class RowsIn { file, sqlites_log };

// A journal of the genesis "bone". Version 1 stored no times. `where`: whether the program was closed or killed.
void make_old_journal(const std::filesystem::path& file, int version, const std::vector<JournalEntry>& entries,
                      RowsIn where);

}  // namespace osteon
