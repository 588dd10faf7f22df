// Journals as the programs of earlier versions made them: their tables, in their words.
#pragma once
#include <filesystem>
#include <vector>

#include "server/journal/chain.hpp"

namespace osteon {

enum class RowsIn { file, sqlites_log };

// Of the genesis "bone". Version 1 kept no times. `where`: what the program left when it was closed, or killed.
void make_old_journal(const std::filesystem::path& file, int version, const std::vector<JournalEntry>& entries,
                      RowsIn where);

}  // namespace osteon
