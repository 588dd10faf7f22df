// A server that takes cases beside the bench of a window, and the dialog that sends one.
#pragma once
#include <QLineEdit>
#include <QPushButton>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "tests/integration/window_bench.hpp"
#include "tests/support/process.hpp"
#include "tests/support/temp_dir.hpp"

namespace osteon::test {

// `Bench`: the bench of the page from which cases are sent.
template <class Bench>
class SendingBench : public Bench {
 protected:
  void SetUp() override {
    Bench::SetUp();
    start_server({"--uploads", uploads_.path(), "--rooms", rooms_.path()});
  }
  void TearDown() override {
    server_.reset();
    Bench::TearDown();
  }

  void start_server(std::vector<std::string> more) {
    const std::filesystem::path address = this->desk_->temp() / "address";
    std::filesystem::remove(address);
    more.insert(more.end(), {"--plain", "--case", this->desk_->bone(), "--address-file", address});
    server_.emplace(program("osteon-server"), more);
    address_ = wait_for_address(address, std::chrono::seconds(60)).value_or("");
    ASSERT_FALSE(address_.empty()) << server_->err();
  }
  [[nodiscard]] std::string listed(const std::string& what) const {
    return run(program("osteon-server"), {what, "list", "--plain", "--server", address_}).out;
  }
  // What the dialog says.
  [[nodiscard]] std::string words() const { return this->label("send_words").toStdString(); }
  // Fills the open dialog and presses its button.
  void send(const std::string& address, const char* room = "") {
    this->template part<QLineEdit>("address").setText(QString::fromStdString(address));
    this->template part<QLineEdit>("new_room").setText(room);
    this->template part<QLineEdit>("certificates").clear();
    this->template part<QLineEdit>("ticket").clear();
    QTest::mouseClick(&this->template part<QPushButton>("send_case"), Qt::LeftButton);
  }
  [[nodiscard]] bool at_rest() const { return this->template part<QPushButton>("send_case").isEnabled(); }

  TempDir uploads_, rooms_;
  std::optional<Process> server_;
  std::string address_;
};

}  // namespace osteon::test
