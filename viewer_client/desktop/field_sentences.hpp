// Sentences of the libraries and programs name options of the command line. Who sees a window fills in fields.
#pragma once
#include <QString>

#include "common/core/result.hpp"

namespace osteon {

// The sentence with the window's fields in place of such options. An option of whoever runs the server stays.
[[nodiscard]] QString with_fields(const QString& sentence);
[[nodiscard]] QString sentence_of(const Error& error);

}  // namespace osteon
