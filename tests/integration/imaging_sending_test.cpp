// From the kept bone of a CT to a case on a server: the server gets the bone that was chosen, and who cancels leaves
// nothing, unless somebody may need it.
#include <gtest/gtest.h>

#include <QCheckBox>
#include <QDesktopServices>
#include <QDialog>
#include <QPushButton>
#include <QTest>
#include <QTextBrowser>
#include <algorithm>
#include <csignal>
#include <filesystem>
#include <set>
#include <string>

#include "common/volume/case.hpp"
#include "tests/integration/imaging_bench.hpp"
#include "tests/integration/sending_bench.hpp"
#include "tests/support/content.hpp"
#include "viewer_client/desktop/library.hpp"

namespace osteon {
namespace {

class ImagingSendingTest : public test::SendingBench<test::ImagingBench> {
 protected:
  void SetUp() override {
    SendingBench::SetUp();
    open_two_balls();
    EXPECT_FALSE(part<QPushButton>("send_bone").isEnabled()) << "no bone is kept";
    islands().item(1)->setCheckState(Qt::Checked);
  }
  [[nodiscard]] bool asks() const {
    const auto* dialog = window_->findChild<QDialog*>("send_dialog");
    return dialog != nullptr && dialog->isVisible();
  }
  [[nodiscard]] std::string said() const { return label("imaging_words").toStdString(); }
  void press_send() {
    ASSERT_TRUE(part<QPushButton>("send_bone").isEnabled());
    QTest::mouseClick(&part<QPushButton>("send_bone"), Qt::LeftButton);
  }
  // Presses the page's button, and waits for the dialog.
  void make_to_send() {
    press_send();
    ASSERT_TRUE(until([&] { return asks(); })) << said();
    EXPECT_TRUE(at_rest());
  }
  // The case that is there and was not before. Empty: none.
  [[nodiscard]] static std::filesystem::path new_case(const std::set<std::string>& before) {
    for (const std::string& name : test::names_in(cases_folder()))
      if (!before.contains(name) && is_case(cases_folder() / name)) return cases_folder() / name;
    return {};
  }
  void escape() { QTest::keyClick(&part<QDialog>("send_dialog"), Qt::Key_Escape); }
};

TEST_F(ImagingSendingTest, TheServerGetsTheKeptBone) {
  const std::set<std::string> before = test::names_in(cases_folder());
  QTest::keySequence(window_.get(), QKeySequence("Ctrl+Alt+U"));
  ASSERT_TRUE(until([&] { return asks(); })) << said();
  // After a refusal the same bone is sent.
  send("nowhere");
  ASSERT_TRUE(until([&] { return at_rest(); })) << words();
  EXPECT_NE(words().find("is not HOST:PORT"), std::string::npos) << words();
  // Enter sends again.
  part<QLineEdit>("address").setText(QString::fromStdString(address_));
  EXPECT_EQ(QApplication::focusWidget(), &part<QPushButton>("send_case")) << "and not the button that closes it";
  QTest::keyClick(QApplication::focusWidget(), Qt::Key_Return);
  ASSERT_TRUE(until([&] { return at_rest(); })) << words();
  EXPECT_EQ(words(), address_ + " has the case now.");
  escape();
  EXPECT_FALSE(asks());

  // Its case, edit list, and nothing else stay, and the edits of the page.
  std::set<std::string> after = test::names_in(cases_folder());
  for (const std::string& name : before) after.erase(name);
  EXPECT_EQ(after, (std::set<std::string>{"balls", "balls.edits.yaml"}));
  EXPECT_EQ(islands().item(1)->checkState(), Qt::Checked);
  EXPECT_TRUE(islands().isVisible());
  const auto here = Case::load(cases_folder() / "balls");
  ASSERT_TRUE(here) << here.error().message;
  EXPECT_NEAR(here->volume_mm3(), test::kBall_mm3, 0.05 * test::kBall_mm3) << "one ball";
  EXPECT_NE(listed("cases").find(to_hex(here->hash())), std::string::npos);
}

TEST_F(ImagingSendingTest, WhoCancelsLeavesNothing) {
  const std::set<std::string> before = test::names_in(cases_folder());
  press_send();
  EXPECT_TRUE(part<QPushButton>("imaging_cancel").isVisible());
  QTest::mouseClick(&part<QPushButton>("imaging_cancel"), Qt::LeftButton);
  ASSERT_TRUE(until([&] { return !part<QPushButton>("imaging_cancel").isVisible(); }));
  EXPECT_EQ(said(), "Cancelled. Nothing was written.");
  EXPECT_FALSE(asks());
  EXPECT_EQ(test::names_in(cases_folder()), before);

  make_to_send();
  EXPECT_TRUE(is_file(unsent_mark(new_case(before)))) << "for the next window, if this one is killed";
  escape();
  EXPECT_FALSE(asks());
  EXPECT_EQ(test::names_in(cases_folder()), before) << "nobody has sent it";
  EXPECT_EQ(said(), "The case of the bone is removed again. The edits are still here.");

  // The server stands still, so the packed case waits for it.
  make_to_send();
  server_->signal(SIGSTOP);
  send(address_);
  ASSERT_TRUE(until([&] { return words().starts_with("Connecting"); })) << words();
  escape();
  ASSERT_TRUE(until([&] { return at_rest(); })) << words();
  EXPECT_EQ(words(), "Cancelled. The server stored nothing. Send the case again, or close.");
  escape();
  EXPECT_FALSE(asks());
  EXPECT_TRUE(until([&] { return test::names_in(cases_folder()) == before; }));
  server_->signal(SIGCONT);
  EXPECT_TRUE(std::filesystem::is_empty(uploads_.path()));

  // A window that goes takes the case with it.
  make_to_send();
  window_.reset();
  const std::set<std::string> after = test::names_in(cases_folder());
  EXPECT_TRUE(std::ranges::includes(before, after)) << "its scratch files go, too";
}

TEST_F(ImagingSendingTest, ACaseThatSomebodyMayNeedStays) {
  std::set<std::string> before = test::names_in(cases_folder());
  part<QCheckBox>("with_report").click();
  QTextBrowser browser;
  QDesktopServices::setUrlHandler("file", &browser, "setSource");
  make_to_send();
  QDesktopServices::unsetUrlHandler("file");
  const std::filesystem::path first = new_case(before);
  ASSERT_FALSE(first.empty());
  const std::string page = (report_folder(first) / "report.html").string();
  EXPECT_EQ(browser.source().toLocalFile().toStdString(), page);
  EXPECT_EQ(said(), "The bone is made. Its report is in " + page + ". Send the bone in the dialog.");
  // From the menu, it is the same dialog. Another one would take the case away.
  window_->send_case(cases_folder() / "." / first.filename());
  EXPECT_TRUE(asks());
  EXPECT_TRUE(is_case(first));
  // The server has the case, and no room.
  send(address_, "two words");
  ASSERT_TRUE(until([&] { return at_rest(); })) << words();
  EXPECT_NE(words().find("has the case, but did not open the room"), std::string::npos) << words();
  escape();
  EXPECT_FALSE(asks());
  EXPECT_TRUE(is_case(first));
  EXPECT_TRUE(is_file(edit_list_of(first)));
  EXPECT_TRUE(is_file(page));

  // Somebody opens it, and closes the dialog before its room is open.
  before = test::names_in(cases_folder());
  part<QCheckBox>("with_report").click();
  islands().item(0)->setCheckState(Qt::Checked);
  make_to_send();
  const std::filesystem::path second = new_case(before);
  ASSERT_FALSE(second.empty());
  EXPECT_NE(words().find("stays only if it is sent"), std::string::npos) << words();
  window_->practise(cases_folder() / "." / second.filename());
  EXPECT_EQ(words().find("stays only if it is sent"), std::string::npos) << words();
  escape();
  EXPECT_FALSE(asks());
  EXPECT_TRUE(is_case(second));
}

TEST_F(ImagingSendingTest, OneCaseIsSentAndOpened) {
  const std::set<std::string> before = test::names_in(cases_folder());
  make_to_send();
  const std::filesystem::path made = new_case(before);
  auto cases = test::names_in(cases_folder());
  make_to_send();
  QTest::mouseClick(&part<QPushButton>("make_bone"), Qt::LeftButton);
  ASSERT_TRUE(until([&] { return view_->surface_shown(); })) << said();
  cases.erase(unsent_mark(made).filename().string());
  EXPECT_EQ(test::names_in(cases_folder()), cases);
  escape();
  EXPECT_TRUE(is_case(made)) << "it is open";
  EXPECT_EQ(recent_entries().front().bone, made);
  // Other cases have the title of the scan, too.
  const QString title = recent_entries().front().title.section('\n', 0, 0);
  EXPECT_EQ(title.toStdString(), "CT (" + made.filename().string() + ")");
  EXPECT_EQ(case_title(made), "CT") << "a file that leaves this computer is called so";

  // The page and its edits are there beside the open bone. Another edit is another case.
  trigger("import_scan");
  ASSERT_TRUE(islands().isVisible());
  EXPECT_EQ(islands().item(1)->checkState(), Qt::Checked);
  islands().item(0)->setCheckState(Qt::Checked);
  make_to_send();
  EXPECT_NE(test::names_in(cases_folder()), cases);
}

}  // namespace
}  // namespace osteon
