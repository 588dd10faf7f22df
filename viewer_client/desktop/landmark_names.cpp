#include "viewer_client/desktop/landmark_names.hpp"

#include <QCoreApplication>
#include <algorithm>
#include <array>

namespace osteon {

namespace {

constexpr std::array kStandardLandmarks{QT_TRANSLATE_NOOP("ImagingLandmarks", "Centre of the femoral head"),
                                        QT_TRANSLATE_NOOP("ImagingLandmarks", "Greater trochanter"),
                                        QT_TRANSLATE_NOOP("ImagingLandmarks", "Medial epicondyle"),
                                        QT_TRANSLATE_NOOP("ImagingLandmarks", "Lateral epicondyle"),
                                        QT_TRANSLATE_NOOP("ImagingLandmarks", "Tibial tuberosity"),
                                        QT_TRANSLATE_NOOP("ImagingLandmarks", "Medial malleolus"),
                                        QT_TRANSLATE_NOOP("ImagingLandmarks", "Lateral malleolus"),
                                        QT_TRANSLATE_NOOP("ImagingLandmarks", "Anterior superior iliac spine"),
                                        QT_TRANSLATE_NOOP("ImagingLandmarks", "Pubic tubercle")};

QString title_of_standard(const char* name) { return QCoreApplication::translate("ImagingLandmarks", name); }

}  // namespace

QStringList suggested_landmarks() {
  QStringList titles;
  for (const char* name : kStandardLandmarks) titles << title_of_standard(name);
  return titles;
}

QString landmark_title(const std::string& name) {
  const auto standard = std::ranges::find(kStandardLandmarks, name);
  return standard != kStandardLandmarks.end() ? title_of_standard(*standard) : QString::fromStdString(name);
}

std::string landmark_name(const QString& shown) {
  const QString text = shown.trimmed();
  for (const char* name : kStandardLandmarks)
    if (text == title_of_standard(name)) return name;
  return text.toStdString();
}

}  // namespace osteon
