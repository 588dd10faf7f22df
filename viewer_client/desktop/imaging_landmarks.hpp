// The landmarks of the page of image processing: the name of the next one, and the list of all.
#pragma once
#include <QCoreApplication>
#include <QWidget>
#include <functional>
#include <string>

#include "viewer_client/imaging/imaging_edits.hpp"

class QComboBox;
class QListWidget;
class QListWidgetItem;
class QPushButton;

namespace osteon {

// [GUI thread]
class ImagingLandmarks : public QWidget {
  Q_DECLARE_TR_FUNCTIONS(ImagingLandmarks)

 public:
  struct Events {
    std::function<void(const std::string&name)> show, remove;
    std::function<void(const std::string& name, const std::string& other)> rename;
  };
  explicit ImagingLandmarks(Events events, QWidget* parent = nullptr);

  // The landmarks that there are.
  void follow(const ImagingEdits& edits);
  // Of the next click, as the case has it: a landmark that is there moves.
  [[nodiscard]] std::string name() const;

 private:
  void show_item(const QListWidgetItem* item);

  Events events_;
  QComboBox* name_;
  QListWidget* list_;
  QPushButton* remove_;
  bool filling_ = false;  // the list changes by itself
};

}  // namespace osteon
