#include "tests/integration/desk.hpp"

#include <QVTKOpenGLNativeWidget.h>
#include <QCursor>
#include <QSurfaceFormat>
#include <cstdlib>

#include "tests/support/process.hpp"

namespace osteon::test {

Desk::Desk() : screen_(Xvfb::start("1600x1100")) {
  if (!screen_) return;
  ::setenv("DISPLAY", screen_->display().c_str(), 1);
  ::setenv("QT_QPA_PLATFORM", "xcb", 1);
  ::setenv("LIBGL_ALWAYS_SOFTWARE", "1", 1);
  for (const char* name : {"XDG_DATA_HOME", "XDG_CONFIG_HOME", "XDG_RUNTIME_DIR"}) {
    const std::filesystem::path folder = temp_.path() / name;
    std::filesystem::create_directories(folder);
    std::filesystem::permissions(folder, std::filesystem::perms::owner_all);
    ::setenv(name, folder.c_str(), 1);
  }
  QSurfaceFormat::setDefaultFormat(QVTKOpenGLNativeWidget::defaultFormat());
  application_.emplace(count_, arguments_);
  QApplication::setApplicationName("osteon");
  QApplication::setOrganizationName("osteon");
  // The screen's own pointer stays off the windows, which are in the other corner. Otherwise they also get its events.
  QCursor::setPos(1599, 1099);
}

std::filesystem::path Desk::bone() {
  const std::filesystem::path folder = temp_.path() / "block";
  if (std::filesystem::exists(folder)) return folder;
  const auto made = run(program("osteon-import"), {"phantom", "block", "--layers", "5:1.9,20:0.3,5:1.9", "--width",
                                                   "40", "--pitch", "0.5", "--out", folder.string()});
  return made.exit_code == 0 ? folder : std::filesystem::path();
}

std::filesystem::path Desk::tibia() {
  const std::filesystem::path folder = temp_.path() / "tibia";
  if (std::filesystem::exists(folder)) return folder;
  const auto made = run(program("osteon-import"), {"phantom", "tibia", "--pitch", "1.5", "--out", folder.string()});
  return made.exit_code == 0 ? folder : std::filesystem::path();
}

}  // namespace osteon::test
