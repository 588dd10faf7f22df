// Words on a picture, and the letters of the patient's sides at its edges.
#pragma once
#include <QColor>
#include <QString>

#include "viewer_client/imaging/patient_letters.hpp"

class QPainter;
class QRect;

namespace osteon {

inline constexpr int kWordsEdge_px = 4;  // words keep so far from the edges

// With a black outline, so that white letters are read on bone too. `flags`: of Qt::Alignment.
void write_outlined(QPainter& painter, const QRect& where, int flags, const QString& text,
                    const QColor& colour = Qt::white);

// `picture`: where all of it is shown.
void paint_edge_letters(QPainter& painter, const QRect& picture, const EdgeLetters& letters);

}  // namespace osteon
