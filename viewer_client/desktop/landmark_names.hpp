// Names of landmarks. A case has the standard English ones, so that it is the same in every language of the window.
// People see them in their own.
#pragma once
#include <QString>
#include <QStringList>
#include <string>

namespace osteon {

// The standard ones, as people see them.
[[nodiscard]] QStringList suggested_landmarks();
// How people see a name. One that is not standard is the same.
[[nodiscard]] QString landmark_title(const std::string& name);
// The name of what a person has chosen or written.
[[nodiscard]] std::string landmark_name(const QString& shown);

}  // namespace osteon
