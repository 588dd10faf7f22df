// What tests of the window share: one screen, one application and one folder of the user's data.
#pragma once
#include <QApplication>
#include <filesystem>
#include <optional>

#include "tests/support/temp_dir.hpp"
#include "tests/support/xvfb.hpp"

namespace osteon::test {

// Sets the environment of the whole process. Only one at a time: Qt has one application for each process.
class Desk {
 public:
  Desk();
  // False if Xvfb did not start.
  [[nodiscard]] bool stands() const { return application_.has_value(); }
  // The case of a block of bone, 40 mm wide: cortical layers of 5 mm above and below marrow. Empty if osteon-import
  // cannot make it.
  [[nodiscard]] std::filesystem::path bone();
  // A phantom of a tibia with vessels and a nerve. Empty if osteon-import cannot make it.
  [[nodiscard]] std::filesystem::path tibia();
  [[nodiscard]] const TempDir& temp() const { return temp_; }

 private:
  TempDir temp_;
  std::optional<Xvfb> screen_;
  int count_ = 1;
  char name_[7] = "osteon";
  char* arguments_[2] = {name_, nullptr};
  std::optional<QApplication> application_;
};

}  // namespace osteon::test
