#include "viewer_client/desktop/structure_names.hpp"

#include <QCoreApplication>
#include <QStringList>

namespace osteon {

namespace {

// The names in common/phantoms, for lupdate, which does not read those files.
[[maybe_unused]] constexpr const char* kNamesOfPhantoms[] = {
    QT_TRANSLATE_NOOP("Structures", "femur"),
    QT_TRANSLATE_NOOP("Structures", "tibia"),
    QT_TRANSLATE_NOOP("Structures", "patella"),
    QT_TRANSLATE_NOOP("Structures", "pelvis"),
    QT_TRANSLATE_NOOP("Structures", "mechanical axis"),
    QT_TRANSLATE_NOOP("Structures", "anatomical axis"),
    QT_TRANSLATE_NOOP("Structures", "neck axis"),
    QT_TRANSLATE_NOOP("Structures", "transepicondylar axis"),
    QT_TRANSLATE_NOOP("Structures", "posterior condylar axis"),
    QT_TRANSLATE_NOOP("Structures", "plateau slope"),
    QT_TRANSLATE_NOOP("Structures", "patellar ridge"),
    QT_TRANSLATE_NOOP("Structures", "femoral head cartilage"),
    QT_TRANSLATE_NOOP("Structures", "femoral condyle cartilage"),
    QT_TRANSLATE_NOOP("Structures", "patellar cartilage"),
    QT_TRANSLATE_NOOP("Structures", "tibial cartilage"),
    QT_TRANSLATE_NOOP("Structures", "acetabular cartilage"),
    QT_TRANSLATE_NOOP("Structures", "left acetabular cartilage"),
    QT_TRANSLATE_NOOP("Structures", "right acetabular cartilage"),
    QT_TRANSLATE_NOOP("Structures", "acetabular opening"),
    QT_TRANSLATE_NOOP("Structures", "left acetabular opening"),
    QT_TRANSLATE_NOOP("Structures", "right acetabular opening"),
    QT_TRANSLATE_NOOP("Structures", "femoral artery"),
    QT_TRANSLATE_NOOP("Structures", "popliteal artery"),
    QT_TRANSLATE_NOOP("Structures", "anterior tibial artery"),
    QT_TRANSLATE_NOOP("Structures", "sciatic nerve"),
    QT_TRANSLATE_NOOP("Structures", "tibial nerve"),
    QT_TRANSLATE_NOOP("Structures", "common peroneal nerve"),
    QT_TRANSLATE_NOOP("Structures", "anterior cruciate ligament"),
    QT_TRANSLATE_NOOP("Structures", "posterior cruciate ligament"),
    QT_TRANSLATE_NOOP("Structures", "medial collateral ligament"),
    QT_TRANSLATE_NOOP("Structures", "lateral collateral ligament"),
    QT_TRANSLATE_NOOP("Structures", "patellar ligament"),
    QT_TRANSLATE_NOOP("Structures", "fibula")};

}  // namespace

QString structure_title(const std::string& name) {
  // A joint names its bones before a comma, a ligament after it.
  QStringList parts = QString::fromStdString(name).split(", ");
  for (QString& part : parts) part = QCoreApplication::translate("Structures", part.toUtf8().constData());
  return parts.join(", ");
}

}  // namespace osteon
