// The cases of the window: made, opened, saved, and made anew when they are damaged.
#include <QCoreApplication>
#include <QDockWidget>
#include <QFileDialog>
#include <QFileInfo>
#include <QStackedWidget>
#include <QTimer>
#include <utility>

#include "viewer_client/desktop/imaging_page.hpp"
#include "viewer_client/desktop/main_window.hpp"
#include "viewer_client/desktop/send_dialog.hpp"
#include "viewer_client/desktop/start_page.hpp"
#include "viewer_client/desktop/tool_bar.hpp"

namespace osteon {

void MainWindow::make_case(const QString& what, const QStringList& how, const std::filesystem::path& out,
                           const QString& name, const std::filesystem::path& session) {
  if (is_busy()) return;
  start_->show_work(what);
  pages_->setCurrentWidget(start_);
  enable_opening(false);
  maker_ = std::make_unique<CaseMaker>(
      how, out,
      CaseMaker::Events{[this](int percent) { start_->show_progress(percent); },
                        [this, name, session](const std::filesystem::path& bone) {
                          maker_.release()->deleteLater();
                          enable_opening(true);
                          start_->end_work({});
                          practise(bone, session, name);
                        },
                        [this](const QString& sentence) {
                          maker_.release()->deleteLater();
                          enable_opening(true);
                          start_->end_work(sentence.isEmpty() ? tr("Cancelled. Nothing was written.") : sentence);
                        }});
  maker_->start();
}

void MainWindow::open_example(const ExampleBone& bone) {
  if (is_busy() || practice_) return;
  const std::filesystem::path folder = example_folder(bone);
  if (is_case(folder)) return practise(folder);
  // A folder without its case.json is what is left of a case. The import would not write over it.
  std::error_code ignored;
  std::filesystem::remove_all(folder, ignored);
  make_case(tr("%1 is made now. The next time it opens at once.").arg(bone.title), bone.how, folder);
}

bool MainWindow::is_busy() const { return maker_ || checker_ || imaging_->making(); }

void MainWindow::practice_failed(const QString& sentence) {
  const bool joined = room_ && room_->joined();
  if (joined || !opened_ || opened_->bone == made_anew_ || !can_be_made_again(opened_->bone))
    return room_ended(sentence);
  // The object that reports this is still at work, so it goes later.
  QTimer::singleShot(0, this, [this, sentence, entry = *opened_] {
    leave_room();
    check_case(entry, sentence);
  });
}

void MainWindow::check_case(const RecentEntry& entry, const QString& sentence) {
  if (is_busy()) return say(sentence);
  start_->show_work(tr("Checking %1").arg(case_title(entry.bone)));
  enable_opening(false);
  const auto end = [this] {
    checker_.release()->deleteLater();
    enable_opening(true);
  };
  const QString log = text_of(cases_folder() / "check-") + QString::number(QCoreApplication::applicationPid()) + ".log";
  checker_ =
      std::make_unique<ImporterRun>(QStringList{"info", text_of(entry.bone)}, log,
                                    ImporterRun::Events{[](int) {},
                                                        [this, end, sentence](const QString&) {
                                                          end();
                                                          start_->end_work(sentence);
                                                        },
                                                        [this, end, entry, sentence](const QString&) {
                                                          const bool damaged = checker_->refused();
                                                          end();
                                                          damaged ? make_anew(entry) : start_->end_work(sentence);
                                                        }});
  checker_->start();
}

void MainWindow::make_anew(const RecentEntry& entry) {
  const QString title = case_title(entry.bone);
  std::error_code ignored;
  std::filesystem::remove_all(entry.bone, ignored);
  made_anew_ = entry.bone;
  for (const ExampleBone& example : example_bones())
    if (example_folder(example) == entry.bone)
      return make_case(tr("%1 was damaged and is made anew.").arg(title), example.how, entry.bone, entry.name,
                       entry.session);
  start_->end_work(tr("The unpacked copy of %1 was damaged and is removed. Open the file again.")
                       .arg(entry.name.isEmpty() ? title : entry.name));
  start_->refresh();
}

void MainWindow::import_scan(const QString& source) {
  if (is_busy()) return;
  leave_room();
  make_case(tr("Importing %1").arg(source), {"ct", source}, new_case_folder(source));
}

void MainWindow::choose_scan() {
  if (is_busy()) return;
  if (practice_ && imaging_->has_scan()) leave_room();  // it is kept, and the start page goes on with it
  if (!practice_ && !room_) return pages_->setCurrentWidget(imaging_);
  // Nobody leaves a room before a scan is chosen.
  const QString source = ImagingPage::ask_for_source(this);
  if (!source.isEmpty()) process_images(source);
}

void MainWindow::process_images(const QString& source) {
  if (is_busy()) return;
  leave_room();
  pages_->setCurrentWidget(imaging_);
  imaging_->open_source(source);
}

void MainWindow::make_imaging_page() {
  imaging_ = new ImagingPage({[this](bool busy) { enable_opening(!busy); },
                              [this](const std::filesystem::path& bone, const QString& said) {
                                practise(bone);
                                say(said);
                              },
                              [this] { return !sends_already(); },
                              [this](const std::filesystem::path& bone) { return send_made_case(bone); },
                              [this] { pages_->setCurrentWidget(start_); }});
  pages_->addWidget(imaging_);
  connect(pages_, &QStackedWidget::currentChanged, this, [this] { lay_out_page(); });
}

// Image processing needs the place of the panels and tools, which belong to a room.
void MainWindow::lay_out_page() {
  const bool processes = pages_->currentWidget() == imaging_;
  tour_->pause(processes);
  if (processes == !room_layout_.isEmpty()) return;
  if (!processes) {
    restoreState(std::exchange(room_layout_, {}));
    return;
  }
  room_layout_ = saveState();
  tools_->hide();
  for (QDockWidget* panel : findChildren<QDockWidget*>()) panel->hide();
}

std::filesystem::path MainWindow::chosen_case(const QString& title, const QString& folder) {
  // A file dialog chooses files only, so a folder is chosen by its case.json.
  const QString chosen =
      QFileDialog::getOpenFileName(this, title, folder, tr("Cases (*.osteon case.json);;All files (*)"));
  const std::filesystem::path path = chosen.toStdString();
  return path.filename() == "case.json" ? path.parent_path() : path;
}

void MainWindow::choose_case() {
  const std::filesystem::path chosen = chosen_case(tr("Open a case"), {});
  if (chosen.empty()) return;
  is_file(chosen) ? open_case_file(chosen) : practise(chosen);
}

bool MainWindow::sends_already() {
  if (!sender_ || !sender_->sending()) return false;
  say(tr("Another case is being sent. Try again when that is done."));
  raise_sender();
  return true;
}

void MainWindow::raise_sender() {
  sender_->show();
  sender_->raise();
  sender_->activateWindow();
}

void MainWindow::choose_case_to_send() {
  if (sends_already()) return;
  const std::filesystem::path chosen =
      opened_ ? opened_->bone : chosen_case(tr("The case to send"), text_of(cases_folder()));
  if (!chosen.empty()) send_case(chosen);
}

void MainWindow::send_case(const std::filesystem::path& what) {
  if (sends_already()) return;
  // A new dialog would take the place of that one, which removes a case that is not sent when it goes.
  if (sender_ && sender_->isVisible() && sender_->holds(what)) return raise_sender();
  open_send_dialog(what, is_file(what) ? text_of(what.filename()) : case_on_screen(what), true);
}

QString MainWindow::send_made_case(const std::filesystem::path& bone) {
  // Begun from the menu while the case was made. That work is not thrown away.
  if (sends_already()) {
    QString next = tr("Another case is being sent. The new one is in %1; send it after that.").arg(text_of(bone));
    say(next);
    return next;
  }
  if (!sender_ || !sender_->isVisible() || !sender_->holds(bone)) {
    open_send_dialog(bone, case_on_screen(bone), false);
    connect(sender_.get(), &QDialog::finished, this, [this] { imaging_->check_made(); });
  }
  raise_sender();
  return tr("Send the bone in the dialog.");
}

void MainWindow::open_send_dialog(const std::filesystem::path& what, const QString& title, bool stays) {
  const auto ended = [this](bool sent) {
    if (std::exchange(closes_when_sent_, false) && sent) close();
  };
  sender_ = std::make_unique<SendDialog>(what, title, stays ? SendDialog::Stays::always : SendDialog::Stays::if_sent,
                                         ended, this);
  raise_sender();
}

void MainWindow::open_case_file(const std::filesystem::path& file) {
  if (is_busy()) return;
  leave_room();
  const QString name = text_of(file.filename());
  make_case(tr("Opening %1").arg(name), {"unpack", text_of(std::filesystem::absolute(file))}, {}, name);
}

void MainWindow::save_bone_as() {
  if (!opened_) return;
  // With a suffix of its own the dialog asks before it names a file that is there.
  QFileDialog dialog(this, tr("Save the bone"), {}, tr("Cases (*.osteon)"));
  dialog.setAcceptMode(QFileDialog::AcceptSave);
  dialog.setDefaultSuffix("osteon");
  dialog.selectFile(QFileInfo(case_title(opened_->bone)).fileName() + ".osteon");
  if (dialog.exec() == QDialog::Accepted) save_case_file(dialog.selectedFiles().constFirst());
}

void MainWindow::save_case_file(const QString& file) {
  if (!opened_) return;
  if (saver_) return say(tr("Another bone is being saved. Try again when that is done."));
  const QString log = text_of(cases_folder() / "pack-") + QString::number(QCoreApplication::applicationPid()) + ".log";
  const auto end = [this](const QString& sentence) {
    saver_.release()->deleteLater();
    say(sentence);
    if (std::exchange(closes_when_saved_, false)) close();
  };
  // The dialog has asked whether to write over a file that is there.
  saver_ = std::make_unique<ImporterRun>(
      QStringList{"pack", "--replace", text_of(opened_->bone), file}, log,
      ImporterRun::Events{[this, file](int percent) { say(tr("Saving %1: %2 %").arg(file, QString::number(percent))); },
                          [end, file](const QString&) { end(tr("Saved %1.").arg(file)); },
                          [this, end](const QString& why) {
                            closes_when_saved_ = false;  // the user is to read it, and to try again
                            end(why);
                          }});
  saver_->start();
}

}  // namespace osteon
