#include "viewer_client/desktop/tool_names.hpp"

#include <QCoreApplication>
#include <map>

#include "common/tools/tool.hpp"

namespace osteon {

namespace {

// The titles in common/tools/box, for lupdate, which does not read those files.
[[maybe_unused]] constexpr const char* kToolTitles[] = {QT_TRANSLATE_NOOP("Tools", "Femoral broach"),
                                                        QT_TRANSLATE_NOOP("Tools", "Tibial keel broach"),
                                                        QT_TRANSLATE_NOOP("Tools", "Barrel bur 6 mm"),
                                                        QT_TRANSLATE_NOOP("Tools", "Contoured cutting bur 4 mm"),
                                                        QT_TRANSLATE_NOOP("Tools", "Round bur 3.2 mm"),
                                                        QT_TRANSLATE_NOOP("Tools", "Round bur 5 mm"),
                                                        QT_TRANSLATE_NOOP("Tools", "Round bur 6 mm"),
                                                        QT_TRANSLATE_NOOP("Tools", "Drill 1/8 inch"),
                                                        QT_TRANSLATE_NOOP("Tools", "Drill 3.2 mm"),
                                                        QT_TRANSLATE_NOOP("Tools", "Drill 3.5 mm"),
                                                        QT_TRANSLATE_NOOP("Tools", "Drill 5/16 inch"),
                                                        QT_TRANSLATE_NOOP("Tools", "End drill 9.5 mm"),
                                                        QT_TRANSLATE_NOOP("Tools", "Drill sleeve 3.2 mm"),
                                                        QT_TRANSLATE_NOOP("Tools", "Distal cutting block"),
                                                        QT_TRANSLATE_NOOP("Tools", "4-in-1 cutting block"),
                                                        QT_TRANSLATE_NOOP("Tools", "Headless pin 1/8 inch"),
                                                        QT_TRANSLATE_NOOP("Tools", "Headed pin 1/8 inch"),
                                                        QT_TRANSLATE_NOOP("Tools", "Steinmann pin 4 mm"),
                                                        QT_TRANSLATE_NOOP("Tools", "Cylindrical reamer 12 mm"),
                                                        QT_TRANSLATE_NOOP("Tools", "Cylindrical outside reamer 46 mm"),
                                                        QT_TRANSLATE_NOOP("Tools", "Acetabular reamer 50 mm"),
                                                        QT_TRANSLATE_NOOP("Tools", "Oscillating saw 25 mm"),
                                                        QT_TRANSLATE_NOOP("Tools", "Oscillating saw 19 mm"),
                                                        QT_TRANSLATE_NOOP("Tools", "Oscillating saw 9.5 mm"),
                                                        QT_TRANSLATE_NOOP("Tools", "Reciprocating saw"),
                                                        QT_TRANSLATE_NOOP("Tools", "Cortical screw 3.5 mm"),
                                                        QT_TRANSLATE_NOOP("Tools", "Cortical screw 4.5 mm"),
                                                        QT_TRANSLATE_NOOP("Tools", "Cancellous screw 6.5 mm"),
                                                        QT_TRANSLATE_NOOP("Tools", "Trial cup 50 mm"),
                                                        QT_TRANSLATE_NOOP("Tools", "Trial stem")};

using Titles = std::map<std::string, const char*>;

// The name itself, if there is no title.
QString title_in(const Titles& titles, const std::string& name) {
  const auto found = titles.find(name);
  return found == titles.end() ? QString::fromStdString(name) : QCoreApplication::translate("Tools", found->second);
}

}  // namespace

QString tool_title(const std::string& name) {
  const Result<Tool> tool = find_tool(name);
  const QByteArray title = QByteArray::fromStdString(tool ? tool->title : name);
  return QCoreApplication::translate("Tools", title.constData());
}

QString group_title(const std::string& name) {
  static const Titles titles{
      {"drill", QT_TRANSLATE_NOOP("Tools", "Drills")},    {"bur", QT_TRANSLATE_NOOP("Tools", "Burs")},
      {"saw", QT_TRANSLATE_NOOP("Tools", "Saws")},        {"reamer", QT_TRANSLATE_NOOP("Tools", "Reamers")},
      {"broach", QT_TRANSLATE_NOOP("Tools", "Broaches")}, {"guide", QT_TRANSLATE_NOOP("Tools", "Guides and trials")},
      {"pin", QT_TRANSLATE_NOOP("Tools", "Pins")},        {"screw", QT_TRANSLATE_NOOP("Tools", "Screws")}};
  return title_in(titles, name);
}

QString law_title(const std::string& name) {
  static const Titles titles{{"chi", QT_TRANSLATE_NOOP("Tools", "Measured thrust")},
                             {"allotta", QT_TRANSLATE_NOOP("Tools", "Energy of the removed volume")},
                             {"agus", QT_TRANSLATE_NOOP("Tools", "Erosion")},
                             {"milling", QT_TRANSLATE_NOOP("Tools", "Milling")},
                             {"spring-damper", QT_TRANSLATE_NOOP("Tools", "Spring and damper")},
                             {"multi-point", QT_TRANSLATE_NOOP("Tools", "Sum over contact points")},
                             {"saw", QT_TRANSLATE_NOOP("Tools", "Single teeth of a saw")},
                             {"reamer", QT_TRANSLATE_NOOP("Tools", "Reaming")},
                             {"broach", QT_TRANSLATE_NOOP("Tools", "Blows of a mallet")}};
  return title_in(titles, name);
}

}  // namespace osteon
