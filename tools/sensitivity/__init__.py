"""Which of the doubtful assumptions of the rush hour decides what two-stage deceleration brings."""
