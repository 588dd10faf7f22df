#include "viewer_client/desktop/edge_letters.hpp"

#include <QPainter>

namespace osteon {

void write_outlined(QPainter& painter, const QRect& where, int flags, const QString& text, const QColor& colour) {
  painter.setPen(Qt::black);
  for (const QPoint& by : {QPoint(1, 0), QPoint(-1, 0), QPoint(0, 1), QPoint(0, -1)})
    painter.drawText(where.translated(by), flags, text);
  painter.setPen(colour);
  painter.drawText(where, flags, text);
}

void paint_edge_letters(QPainter& painter, const QRect& picture, const EdgeLetters& letters) {
  const QRect inner = picture.adjusted(kWordsEdge_px, kWordsEdge_px, -kWordsEdge_px, -kWordsEdge_px);
  const auto paint = [&](int flags, const std::string& at) {
    write_outlined(painter, inner, flags, QString::fromStdString(at));
  };
  paint(Qt::AlignVCenter | Qt::AlignLeft, letters.left);
  paint(Qt::AlignVCenter | Qt::AlignRight, letters.right);
  paint(Qt::AlignTop | Qt::AlignHCenter, letters.top);
  paint(Qt::AlignBottom | Qt::AlignHCenter, letters.bottom);
}

}  // namespace osteon
