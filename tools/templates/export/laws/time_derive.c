    p->gain = s->alpha * per_scale;
    p->beta_per_s = fabs(s->beta_per_s);
